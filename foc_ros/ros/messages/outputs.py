"""Old place, to be removed."""

from .encode_prediction import CLOUD_ROW as CLOUD_ROW
from .encode_prediction import LIKELIHOOD_COLUMNS as LIKELIHOOD_COLUMNS
from .encode_prediction import OUTPUTS as OUTPUTS
from .encode_prediction import likelihood_array as likelihood_array
from .encode_prediction import output_messages as output_messages
from .encode_prediction import prediction_cloud as prediction_cloud

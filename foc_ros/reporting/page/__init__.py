"""Pages that people read: one frame for every report; each page is one HTML file that needs no network."""

from .frame import data_script, own_part, own_scripts, page_of, picture, pictures, plotly_script, table

__all__ = ['data_script', 'own_part', 'own_scripts', 'page_of', 'picture', 'pictures', 'plotly_script', 'table']

"""The paper's studies redone: scenes enter; efforts, ratios and trends leave."""

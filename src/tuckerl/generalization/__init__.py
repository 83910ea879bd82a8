"""The paper's idea: from a window of Q-tables to action weights and to the table that all agents go on with."""

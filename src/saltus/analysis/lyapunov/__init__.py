"""How fast small deviations grow along motions of a flow."""

"""The questions of a study: what each computes, tabulates and draws."""

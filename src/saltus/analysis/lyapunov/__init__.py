"""Lyapunov exponents: growth rates of small deviations along motions of a flow."""

"""The kinematic pairs as frozen values, the common ones apart from those of few mechanisms."""

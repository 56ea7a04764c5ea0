"""Inputs that the verbs share: starts, boxes, values along an axis, outputs, arguments."""

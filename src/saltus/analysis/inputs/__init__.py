"""What every verb takes in: starts, boxes, values along an axis, outputs, arguments."""

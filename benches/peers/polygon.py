"""The area that a tip encloses."""


def enclosed_area(path):
    """Signed area (mm^2) of the closed polygon of tip positions, counter-clockwise positive."""
    following = [*path[1:], path[0]]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(path, following)) / 2

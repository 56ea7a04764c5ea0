"""Template: the test whether a trajectory has entered a neighbourhood of an attractor in which the
return map was verified to contract.
"""


@entry
def capture(points, centres, weights, owners, extents, label, when):
    """Test every point of every trajectory, in order, until one lies in an ellipsoid |W (p - c)| <=
    1.

    points f8[k, n, D]; centres f8[m, D], ascending in their first coordinate; weights f8[m, D, D];
    owners i8[m], the attractor of each; extents f8[m]: half the extent of each ellipsoid along the
    first coordinate; out: label i8[k], the owner, or untouched; when i8[k], the index of the point.
    Returns how many were captured.
    """
    count, size, found, reach = centres.shape[0], points.shape[2], 0, 0.0
    for i in range(count):
        reach = max(reach, extents[i])
    for i in range(points.shape[0]):
        for j in range(points.shape[1]):
            first = points[i, j, 0]
            low, high = 0, count
            while low < high:
                middle = (low + high) // 2
                if centres[middle, 0] < first - reach:
                    low = middle + 1
                else:
                    high = middle
            owner = -1
            while low < count and centres[low, 0] <= first + reach:
                total = 0.0 if abs(first - centres[low, 0]) <= extents[low] else 2.0
                for row in range(size):
                    if total > 1.0:
                        break
                    part = 0.0
                    for column in range(size):
                        part += weights[low, row, column] * (
                            points[i, j, column] - centres[low, column]
                        )
                    total += part * part
                if total <= 1.0:
                    owner = owners[low]
                    break
                low += 1
            if owner >= 0:
                label[i], when[i] = owner, j
                found += 1
                break
    return found

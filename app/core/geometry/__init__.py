"""From touched points to elements and their form: least squares, minimum zone, and why some points will not do.

==============  ==================================================================================
points          what is asked of points before anything is fitted through them, and `Degenerate`
circle          the circle, in its plane and in space
line            the line, in a plane and in space
plane           the plane
minimum_zones   minimum zones (Chebyshev) of all three, and of an axis
discs           largest inscribed, smallest circumscribed circle
elements        axes and planes as they are touched, with their cofactors
form, relations form and position, verdicts
outliers, suspect_points  points that do not belong to the element
==============  ==================================================================================

Every fit is geometric: what is minimised are the orthogonal distances, not the residuals of an equation. Points are
moved to their centroid first, so that it does not matter how far from the machine's zero the part is clamped. mm.
"""

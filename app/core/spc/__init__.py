"""Statistical process control: control charts, run rules, capability, gauge studies.

Limits are estimated once, from a baseline that a person has chosen (`shewhart.individuals_baseline` …), and readings are
judged by them afterwards (`shewhart.chart_of` …): nothing in here estimates a limit from the readings it judges.
Constants are computed (`constants`), results are frozen and say where they come from, and what cannot be said of too few
readings is refused with a `Refusal` that says how many are missing.

    constants    d2, d3, c4 and the factors of control charts, for any subgroup size
    variation    spread or rounding noise: the one threshold of no variation
    spread       estimates of sigma, each with its degrees of freedom
    shewhart     individuals, moving range, X-bar, R and S charts, unequal subgroups too
    ewma         exponentially weighted and plain moving averages
    counts       p, np, c, u and Laney's charts of counts
    cusum        tabular cumulative sums with headstart
    rules        the Nelson and the Western Electric rules, all signals as runs of points
    chance       how often they fire though nothing has happened
    false_alarms the same of several rules together, and of the limits of any chart
    points       the points of any chart as readings come in
    watch        rules that watch a chart while readings come in
    capability   Cp to Cpm with intervals, parts out of tolerance
    normality    Anderson-Darling, Shapiro-Wilk
    distributions, mixture, fitting   which distribution fits readings that are not normal, and their indices
    tolerance_interval, machine_performance   where all parts lie; Pm and Pmk of an undisturbed run
    gauge        type 1, bias, linearity, gauge R&R, and what they say about R33
"""

USUAL_READINGS = 1000
"""The default window of every index, in all rooms: the last N readings, as many as percentiles want."""

-- Rows that the first published program (commit ef7d1ef, revision 0018) has written, as pg_dump gives them: readings with
-- corrections and alarms, a calibration, gauge studies, results of geometry, a baseline, and who did it. The report was
-- cancelled by hand, its file is not here. Its machine's key, an administrator's key and Ana's password are in first_program.py.
INSERT INTO public.machine (id, key, name, control, created_at, signal_path, signal_delay, signal_jitter, probing_feed, corrections_expire_after) OVERRIDING SYSTEM VALUE VALUES
	(1, 'lathe-1', 'Lathe 1', 'sinumerik', '2025-11-23 01:03:35.804071+00', 'direct', 0.25, NULL, 150, NULL);
INSERT INTO public.alarm (machine_id, id, kind, characteristic_id, tool_memory, raised_at, last_at, count, sequence, last_sequence, data, acknowledged_at, acknowledged_by, action, comment, outcome) VALUES
	(1, 1, 'tool_worn', 1, 3, '2025-11-23 01:03:49.865185+00', '2025-11-23 01:03:49.865185+00', 1, 25, 25, '{"limit": 0.3, "decided": 0.4, "deviation": 0.4, "characteristic": "shaft-d40"}', '2025-11-23 01:03:50.157299+00', 'key command line', 'tool_replaced', 'New insert', '[{"code": "tool_restarted", "tool": 3, "parts": 25, "offset": 0.0}, {"code": "corrections_superseded", "numbers": [4]}, {"code": "averages_restarted", "locations": [5]}]'),
	(1, 2, 'oversize', 1, 3, '2025-11-23 01:03:50.179501+00', '2025-11-23 01:03:50.179501+00', 1, 26, 26, '{"limit": 0.008, "decided": 0.009, "deviation": 0.009, "characteristic": "shaft-d40"}', '2025-11-23 01:03:50.24513+00', 'key command line', 'noted', 'Micrometer', '[{"code": "measured_by_hand", "good": false, "measured": 40.0085, "sequence": 26, "characteristic": "shaft-d40"}]'),
	(1, 3, 'undersize', 1, 3, '2025-11-23 01:03:50.283801+00', '2025-11-23 01:03:50.283801+00', 1, 27, 27, '{"limit": 0.008, "decided": -0.018, "deviation": -0.009, "characteristic": "shaft-d40"}', NULL, NULL, NULL, NULL, NULL),
	(1, 4, 'probe_fault', 1, 3, '2025-11-23 01:03:51.380359+00', '2025-11-23 01:03:51.380359+00', 1, 28, 28, '{"limit": 1.0, "decided": -39.985656154, "deviation": -39.985656154, "characteristic": "shaft-d40"}', NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.alignment (machine_id, id, kind, method, name, part, aligned_at, received_at, actor, key, given, result, pallet_id, part_id, recomputed_from) VALUES
	(1, 1, 'points', 'exact', 'pallet 4', NULL, '2025-11-23 01:03:50.970677+00', '2025-11-23 01:03:50.951166+00', 'key command line', NULL, '{"base": [-306.01, -154.25, -299.85], "touches": [{"normal": [0.0, 0.0, 1.0], "nominal": [10.0, 10.0, 0.0], "deviation": 0.012}, {"normal": [0.0, 0.0, 1.0], "nominal": [180.0, 15.0, 0.0], "deviation": 0.046}, {"normal": [0.0, 0.0, 1.0], "nominal": [90.0, 120.0, 0.0], "deviation": 0.021}, {"normal": [0.0, -1.0, 0.0], "nominal": [20.0, 0.0, -15.0], "deviation": 0.104}, {"normal": [0.0, -1.0, 0.0], "nominal": [170.0, 0.0, -15.0], "deviation": -0.205}, {"normal": [-1.0, 0.0, 0.0], "nominal": [0.0, 60.0, -15.0], "deviation": 0.051}], "work_offset": "G54", "repeatability": 0.002}', '{"rms": 0.0, "shift": [0.069868757, -0.144073724, 0.010654624], "turns": [-0.0037377056, -0.0115648962, 0.1180295167], "advice": {"gain": 1.0653769526058698, "place": [0.0, 0.0, -15.0], "normal": [-1.0, 0.0, 0.0]}, "angles": [-0.0037496148, -0.0115610381, 0.1180298954], "matrix": [[0.9999978578223769, -0.0020599956246946036, -0.0002019125637632618, 0.06986875703468343], [0.0020600087921363547, 0.9999978760653564, 0.00006502732094135213, -0.14407372415275432], [0.00020177817891754786, -0.00006544312329787543, 0.9999999775013818, 0.010654623649670292], [0.0, 0.0, 0.0, 1.0]], "misfits": [], "weakest": [-0.901712, 0.144747, -0.000252, -0.065852, -0.063228, -0.397026], "leverage": [1.0, 1.0, 1.0, 1.0, 1.0, 1.0], "condition": 1.9677346350312679, "residuals": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "deviations": [0.012, 0.046, 0.021, 0.104, -0.205, 0.051], "difference": 0.00033414559409742836, "solved_for": ["a", "b", "c", "lambda", "beta", "gamma"], "uncertainty": {"a": 0.004622646193893234, "b": 0.004615419461750694, "c": 0.004441382683325923, "beta": 0.0019054915696228518, "gamma": 0.0021607591587770544, "lambda": 0.002609013935282401}}', NULL, NULL, NULL);
INSERT INTO public.api_key (id, secret_hash, name, role, machine_id, created_at, revoked_at) OVERRIDING SYSTEM VALUE VALUES
	(1, '\xb2ad84c9a64a64f4ff7ba1831e2aaeec9126d5e150513827b9b15d63ceb553b9', 'command line', 'admin', NULL, '2025-11-23 01:03:06.396728+00', NULL),
	(2, '\x231f274caa86ac342d739142e50f5f0f3c602f120ff86c66853060edb1aab5d7', 'lathe-1', NULL, 1, '2025-11-23 01:03:35.963649+00', NULL),
	(3, '\xe32ca29b29f9ec611bd603a9695e67272307004e16b612fa1eb222cbec5a3384', 'lathe-1', NULL, 1, '2025-11-23 01:03:49.585445+00', NULL);
INSERT INTO public.audit_entry (id, at, actor, action, subject, before, after, why) OVERRIDING SYSTEM VALUE VALUES
	(1, '2025-11-23 01:02:36.080039+00', 'inband serve', 'invitation made', 'people', NULL, '{"role": "admin"}', NULL),
	(2, '2025-11-23 01:03:06.396728+00', 'command line (root)', 'key made', 'people', NULL, '{"id": 1, "name": "command line", "role": "admin"}', NULL),
	(3, '2025-11-23 01:03:35.804071+00', 'key command line', 'machine added', 'machine/lathe-1', NULL, '{"key": "lathe-1", "name": "Lathe 1", "control": "sinumerik"}', NULL),
	(4, '2025-11-23 01:03:35.900026+00', 'key command line', 'characteristic added', 'characteristic/shaft-d40', NULL, '{"key": "shaft-d40", "name": "Bearing seat", "part": null, "unit": "mm", "machine": "lathe-1", "parameters": {"axis": "X", "mode": "automatic", "wait": null, "index": null, "accept": {"m": 1, "n": 1}, "factor": -1.0, "points": 1, "target": 40.0, "feature": "outside", "nominal": null, "repeats": 1, "variant": "single", "max_step": null, "direction": "positive", "max_total": null, "wear_limit": 0.3, "zero_range": 0.001, "path_factor": 1.0, "tool_memory": 3, "wear_policy": "hold", "average_memory": 5, "plausible_jump": null, "averaging_limit": 0.005, "lower_deviation": null, "tolerance_width": 0.016, "upper_deviation": null, "confidence_limit": 1.0, "weighting_factor": 2.0, "rejected_may_correct": false}}', NULL),
	(5, '2025-11-23 01:03:35.963649+00', 'key command line', 'key made', 'machine/lathe-1', NULL, '{"id": 2, "name": "lathe-1"}', NULL),
	(6, '2025-11-23 01:03:49.585445+00', 'key command line', 'key made', 'machine/lathe-1', NULL, '{"id": 3, "name": "lathe-1"}', NULL),
	(7, '2025-11-23 01:03:50.026537+00', 'key command line', 'tool changed', 'tool/lathe-1/3', '{"total": 0.00171605, "offset": 0.00171605}', '{"total": 0.0, "offset": 0.0, "superseded": [4]}', 'New insert'),
	(8, '2025-11-23 01:03:50.026537+00', 'key command line', 'alarm acknowledged', 'alarm/1', '{"state": "active"}', '{"state": "acknowledged", "action": "tool_replaced", "outcome": [{"code": "tool_restarted", "tool": 3, "parts": 25, "offset": 0.0}, {"code": "corrections_superseded", "numbers": [4]}, {"code": "averages_restarted", "locations": [5]}]}', 'New insert'),
	(9, '2025-11-23 01:03:50.212389+00', 'key command line', 'measured by hand', 'reading/shaft-d40/26', '{"measured": 40.009}', '{"good": false, "by_hand": 40.0085}', 'Micrometer'),
	(10, '2025-11-23 01:03:50.212389+00', 'key command line', 'alarm acknowledged', 'alarm/2', '{"state": "active"}', '{"state": "acknowledged", "action": "noted", "outcome": [{"code": "measured_by_hand", "good": false, "measured": 40.0085, "sequence": 26, "characteristic": "shaft-d40"}]}', 'Micrometer'),
	(11, '2025-11-23 01:03:50.307672+00', 'key command line', 'parameters changed', 'characteristic/shaft-d40', '{"zero_range": 0.001}', '{"zero_range": 0.0015}', 'scatter of the new probe'),
	(12, '2025-11-23 01:03:50.360434+00', 'key command line', 'reading excluded', 'reading/shaft-d40/7', '{"excluded": false}', '{"excluded": true}', 'chip under the stylus'),
	(13, '2025-11-23 01:03:50.504848+00', 'key command line', 'offset edited', 'tool/lathe-1/3', '{"total": 0.0, "offset": 0.0}', '{"total": 0.0, "offset": -0.012, "superseded": [5, 6]}', 'set at the control'),
	(14, '2025-11-23 01:03:50.664947+00', 'key command line', 'empirical value changed', 'average/lathe-1/5', '{"average": 0.0, "empirical_value": 0.0}', '{"average": 0.0, "empirical_value": 0.001}', 'CMM'),
	(15, '2025-11-23 01:03:51.671064+00', 'key command line', 'gauge study entered', 'gauge-study/1', NULL, '{"kind": "type_one", "values": 25}', NULL),
	(16, '2025-11-23 01:03:51.802863+00', 'key command line', 'gauge study entered', 'gauge-study/2', NULL, '{"kind": "type_one", "values": 23}', NULL),
	(17, '2025-11-23 01:03:51.919891+00', 'key command line', 'baseline frozen', 'characteristic/shaft-d40', NULL, '{"chart": "individuals", "sigma": 0.001163293688782912, "centre": -0.0003185652173913043, "period": "Readings 1 to 24", "version": 1, "quantity": "deviation"}', 'first'),
	(18, '2025-11-23 01:03:52.085329+00', 'key command line', 'reports asked for', 'reports/1', NULL, '{"format": "csv", "characteristics": 1}', NULL),
	(19, '2025-11-23 01:04:48.163056+00', 'command line (root)', 'person added', 'person/Ana', NULL, '{"name": "Ana", "role": "engineer"}', NULL);
INSERT INTO public.average_memory (machine_id, location, average, empirical_value, updated_at) VALUES
	(1, 1, 0, 0, NULL),
	(1, 2, 0, 0, NULL),
	(1, 3, 0, 0, NULL),
	(1, 4, 0, 0, NULL),
	(1, 6, 0, 0, NULL),
	(1, 7, 0, 0, NULL),
	(1, 8, 0, 0, NULL),
	(1, 9, 0, 0, NULL),
	(1, 10, 0, 0, NULL),
	(1, 11, 0, 0, NULL),
	(1, 12, 0, 0, NULL),
	(1, 13, 0, 0, NULL),
	(1, 14, 0, 0, NULL),
	(1, 15, 0, 0, NULL),
	(1, 16, 0, 0, NULL),
	(1, 17, 0, 0, NULL),
	(1, 18, 0, 0, NULL),
	(1, 19, 0, 0, NULL),
	(1, 20, 0, 0, NULL),
	(1, 5, 0, 0.001, '2025-11-23 01:03:50.66887+00');
INSERT INTO public.characteristic (machine_id, id, key, name, part, unit, created_at) OVERRIDING SYSTEM VALUE VALUES
	(1, 1, 'shaft-d40', 'Bearing seat', NULL, 'mm', '2025-11-23 01:03:35.900026+00');
INSERT INTO public.baseline (machine_id, characteristic_id, version, key, chart, quantity, "grouping", group_size, group_pause, ewma_lambda, ewma_width, ewma_exact, cusum_k, cusum_h, cusum_headstart, average_span, first_sequence, last_sequence, excluded, centre, sigma, estimator, freedom, readings, groups, factor, slope, slope_error, settle, signals, normal_p, repeats, parameters_version, at, actor, reason, retired_at, retired_by, retired_why) VALUES
	(1, 1, 1, NULL, 'individuals', 'deviation', NULL, NULL, NULL, 0.2, 3, true, 0.5, 5, 0, 5, 1, 24, '[]', -0.0003185652173913043, 0.001163293688782912, 'moving_range', 13.49982339296862, 23, 22, -1, NULL, NULL, NULL, 1, 0.11841069145524293, NULL, 2, '2025-11-23 01:03:51.919891+00', 'key command line', 'first', NULL, NULL, NULL);
INSERT INTO public.calibration (machine_id, number, kind, memory, location, calibrated_at, received_at, actor, key, outcome, refused, settings, touches, size, measured, difference, average, value_before, proposed) VALUES
	(1, 1, 'gauge', 'average', 5, '2025-11-21 06:02:11+00', '2025-11-23 01:03:51.412183+00', 'key command line', 'lathe-1:cal:17', 'average_kept', false, '{"axis": "X", "spread": 0.0004, "repeats": 3, "surface": "free", "direction": "negative", "gauge_size": 199.852, "probe_type": "axial", "zero_range": 0.001, "path_factor": 1.0, "tool_memory": 30, "averaging_limit": 0.01, "confidence_limit": 1.0, "weighting_factor": 2.0}', '[199.8552, 199.8548, 199.855]', 199.852, 199.855, 0.003, 0.001, 0.001, NULL);
INSERT INTO public.calibration_plan (machine_id, memory, location, due_parts, due_days, acceptance, since, counts, told) VALUES
	(1, 'average', 5, NULL, NULL, 'accept', '2025-11-21 06:02:11+00', '{"1": 28}', false);
INSERT INTO public.correction (machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status, created_at, decided_at, decided_by, reason, superseded_by, applied_at, applied_by, offset_after, fetched_at, fetched_by, fetched_as) VALUES
	(1, 1, 1, 1, 3, 0.001403, -0.001403, 'applied', '2025-11-23 01:03:49.622866+00', NULL, NULL, NULL, NULL, '2025-11-23 01:03:49.650776+00', 'lathe-1 (key lathe-1)', -0.001403, NULL, NULL, NULL),
	(1, 2, 1, 9, 3, -0.00100327734375, 0.001003277, 'applied', '2025-11-23 01:03:49.708607+00', NULL, NULL, NULL, NULL, '2025-11-23 01:03:49.720152+00', 'lathe-1 (key lathe-1)', -0.000399723, NULL, NULL, NULL),
	(1, 3, 1, 16, 3, -0.0021157734375000002, 0.002115773, 'applied', '2025-11-23 01:03:49.7558+00', NULL, NULL, NULL, NULL, '2025-11-23 01:03:49.767483+00', 'lathe-1 (key lathe-1)', 0.00171605, NULL, NULL, NULL),
	(1, 4, 1, 25, 3, 0.4, -0.4, 'superseded', '2025-11-23 01:03:49.865185+00', '2025-11-23 01:03:50.104851+00', 'key command line', 'New insert', NULL, NULL, NULL, NULL, NULL, NULL, NULL),
	(1, 5, 1, 26, 3, 0.009, -0.009, 'superseded', '2025-11-23 01:03:50.179501+00', '2025-11-23 01:03:50.530551+00', 'key command line', 'set at the control', NULL, NULL, NULL, NULL, NULL, NULL, NULL),
	(1, 6, 1, 27, 3, -0.018, 0.018, 'superseded', '2025-11-23 01:03:50.283801+00', '2025-11-23 01:03:50.530551+00', 'key command line', 'set at the control', NULL, NULL, NULL, NULL, NULL, NULL, NULL);
INSERT INTO public.exclusion (machine_id, characteristic_id, sequence, at, actor, reason) VALUES
	(1, 1, 7, '2025-11-23 01:03:50.360434+00', 'key command line', 'chip under the stylus');
INSERT INTO public.fixture (machine_id, key, basis, reference, warning, alarm, characteristics) VALUES
	(1, 'vice-left', 'first', NULL, NULL, NULL, '{}');
INSERT INTO public.form_measurement (machine_id, id, feature, kind, part, measured_at, received_at, actor, key, given, method, tolerance, repeatability, characteristic_id) VALUES
	(1, 1, 'bore-d50-axis', 'axis_straightness', 'SN-000812', '2025-11-21 08:15:02+00', '2025-11-23 01:03:51.200803+00', 'key command line', NULL, '{"side": "inside", "points": [], "sections": [{"height": 0.0, "touches": [[-6.096, 24.249], [22.578, 10.784], [12.465, -21.678]]}, {"height": 20.0, "touches": [[23.896, -7.346], [20.88, 13.749], [-23.388, 8.859]]}, {"height": 40.0, "touches": [[5.675, 24.341], [-24.71, -3.748], [23.78, -7.699]]}, {"height": 60.0, "touches": [[-12.55, 21.611], [-6.82, -24.059], [23.699, 7.911]]}], "tip_diameter": 6.0}', NULL, 0.005, 0.0005, 1);
INSERT INTO public.form_evaluation (machine_id, form_id, number, at, actor, engine, method, value, uncertainty, verdict, suspects, result) VALUES
	(1, 1, 1, '2025-11-23 01:03:51.200803+00', 'key command line', 1, 'minimum_zone', 0.015343846, 0.00116026, 'bad', 0, '{"tested": true, "values": [{"value": 0.015343846, "method": "minimum_zone", "uncertainty": 0.00116026}, {"value": 0.021087214, "method": "least_squares", "uncertainty": 0.001628302}, {"value": 0.007797981, "method": "printed", "uncertainty": null}], "details": {"axis": {"point": [0.001546355, -0.001131309, 30.0], "length": 60.000007599, "direction": [-0.00036018, -0.000237473, 0.999999907], "lengthwise": true}, "sections": [{"arc": 164.298637082, "off": [0.005843792, -0.000127442, 0.000002075], "centre": [0.018195564, 0.005865435], "height": 0.0, "radius": 25.002259116, "diameter": 56.004518232, "residuals": [0.0, 0.0, 0.0]}, {"arc": 176.333944034, "off": [-0.01045484, -0.00136527, -0.00000409], "centre": [-0.005306681, -0.000121851], "height": 20.0, "radius": 25.004687297, "diameter": 56.009374594, "residuals": [0.0, 0.0, 0.0]}, {"arc": 206.563433719, "off": [0.003378301, 0.003112864, 0.000001956], "centre": [0.001322852, -0.000393173], "height": 40.0, "radius": 24.993879931, "diameter": 55.987759862, "residuals": [0.0, 0.0, 0.0]}, {"arc": 225.932337443, "off": [0.001232747, -0.001620152, 0.000000059], "centre": [-0.008026314, -0.009875647], "height": 60.0, "radius": 24.995266905, "diameter": 55.99053381, "residuals": [0.0, 0.0, 0.0]}]}, "suspects": [], "corrected": null}');
INSERT INTO public.gauge_study (machine_id, id, kind, characteristic_id, key, created_at, created_by) OVERRIDING SYSTEM VALUE VALUES
	(1, 1, 'type_one', 1, NULL, '2025-11-23 01:03:51.671064+00', 'key command line'),
	(1, 2, 'type_one', 1, NULL, '2025-11-23 01:03:51.802863+00', 'key command line');
INSERT INTO public.gauge_study_revision (machine_id, study_id, revision, at, actor, reason, settings, rows) VALUES
	(1, 1, 1, '2025-11-23 01:03:51.671064+00', 'key command line', NULL, '{"each": "reading", "gauge": "T8", "reference": 39.992, "tolerance": 0.016, "resolution": null, "unbalanced": "refuse"}', '[{"values": [39.9921, 39.9923, 39.992, 39.9922, 39.9921, 39.9921, 39.9923, 39.992, 39.9922, 39.9921, 39.9921, 39.9923, 39.992, 39.9922, 39.9921, 39.9921, 39.9923, 39.992, 39.9922, 39.9921, 39.9921, 39.9923, 39.992, 39.9922, 39.9921]}]'),
	(1, 2, 1, '2025-11-23 01:03:51.802863+00', 'key command line', NULL, '{"each": "reading", "gauge": "T8", "source": {"take": "readings", "first": 1, "through": 24, "left_out": [7]}, "reference": 40.0, "tolerance": 0.016, "resolution": null, "unbalanced": "refuse"}', '[{"values": [40.002806, 39.999205, 40.000474, 40.000176, 40.001002, 39.998317, 39.999098, 39.99871, 39.998987, 39.999385, 39.999656, 39.998912, 40.000506, 39.999343, 39.996163, 40.001429, 39.99953, 39.999108, 40.000322, 40.000276, 40.000063, 39.998975, 40.00023]}]');
INSERT INTO public.hand_measurement (machine_id, characteristic_id, sequence, id, at, actor, measured, good, comment, alarm) OVERRIDING SYSTEM VALUE VALUES
	(1, 1, 26, 1, '2025-11-23 01:03:50.212389+00', 'key command line', 40.0085, false, 'Micrometer', 2);
INSERT INTO public.kinematics_run (machine_id, id, form, head, measured_at, received_at, actor, key, given, limits, outcome, reason, results, in_effect, version) VALUES
	(1, 1, 'centres', '', '2025-11-21 06:42:10+00', '2025-11-23 01:03:51.010865+00', 'key command line', NULL, '{"axes": [{"axis": "C", "ball": [180.0, 0.0, 40.0], "carries": "table", "reversed": false, "incidence": 0.0, "positions": [{"angle": -90.0, "centre": [0.0053, -179.9812, 40.0021]}, {"angle": 0.0, "centre": [180.0004, 0.0002, 39.9998]}, {"angle": 90.0, "centre": [0.0204, 179.9957, 40.0052]}, {"angle": 180.0, "centre": [-179.9751, 0.0161, 40.0081]}], "seen_from": "axis", "ball_known": false}], "program": "TNC:\\nc_prog\\preset_452.h", "kinematics": "MILL5_AC", "tip_radius": 0.0, "ball_radius": 12.5, "measured_at": "2025-11-21T06:42:10Z"}', '{"ball_radius": null, "max_dev_cal_ball": null, "max_modification": null, "max_modification_angle": null}', 'measured', '{"code": "measured"}', '{"axes": [{"arc": 270.0, "axis": "C", "ball": [180.0, 0.0, 40.0], "noise": 0.0005639148871873776, "shift": [{"value": 0.0008500000000012707, "deviation": 0.00039874804074224187}, {"value": -0.0000500000000004507, "deviation": 0.00039874804074224165}, {"value": -0.0003499999999991761, "deviation": 0.0004883646178765049}], "angles": [-90.0, 0.0, 90.0, 180.0], "errors": {"EA0C": {"value": 0.0004933803235854225, "deviation": 0.00012692544346467246}, "EB0C": {"value": 0.0013209860276624775, "deviation": 0.0001269254434646725}, "EX0C": {"value": 0.011827777777776358, "deviation": 0.00029555346698953064}, "EY0C": {"value": 0.008044444444438859, "deviation": 0.00029555346698953054}}, "points": 4, "radius": 179.98810016685135, "carries": "table", "freedom": 5, "backlash": null, "condition": 3.4274256833657026, "end_angle": 180.0, "incidence": 0.0, "positions": [{"angle": -90.0, "approach": 0, "measured": [0.0053, 0.0188, 0.0021], "optimised": [0.0003, -0.0008, -0.00015]}, {"angle": 0.0, "approach": 0, "measured": [0.0004, 0.0002, -0.0002], "optimised": [-0.00045, 0.00025, 0.00015]}, {"angle": 90.0, "approach": 0, "measured": [0.0204, -0.0043, 0.0052], "optimised": [-0.0001, -0.0001, -0.00015]}, {"angle": 180.0, "approach": 0, "measured": [0.0249, 0.0161, 0.0081], "optimised": [0.00025, 0.00065, 0.00015]}], "correction": [0.011827777777776358, 0.008044444444438859, 0.0], "mean_error": 0.0005805508667683925, "angle_error": -0.00020690142601610323, "start_angle": -90.0, "scatter_after": 0.0006304760106375507, "greatest_after": 0.0008674675786325869, "position_after": null, "scatter_before": 0.021170144071302462, "greatest_before": 0.030738087123296887, "position_before": null}], "head": {}, "balls": [], "notes": [], "offsets": {"X": 0.00085, "Y": -0.00005, "Z": -0.00035}}', '{}', 0);
INSERT INTO public.machine_state (machine_id, last_correction, version) VALUES
	(1, 6, 45);
INSERT INTO public.outlook (machine_id, characteristic_id, sequence, parameters_version, at, towards, parts, parts_low, parts_high, hunting) VALUES
	(1, 1, 28, 2, '2025-11-23 01:04:50.189715+00', NULL, NULL, NULL, NULL, 'unknown');
INSERT INTO public.paired_reading (machine_id, id, location, at, actor, key, machine_value, true_value, instrument, characteristic_id, sequence, excluded_at, excluded_by, excluded_why) OVERRIDING SYSTEM VALUE VALUES
	(1, 1, 5, '2025-11-23 01:03:51.583934+00', 'key command line', NULL, 40.000474, 39.9998, 'CMM', 1, 3, NULL, NULL, NULL);
INSERT INTO public.parameters_version (machine_id, characteristic_id, version, parameters, created_at, created_by, reason) VALUES
	(1, 1, 1, '{"axis": "X", "mode": "automatic", "wait": null, "index": null, "accept": {"m": 1, "n": 1}, "factor": -1.0, "points": 1, "target": 40.0, "feature": "outside", "nominal": null, "repeats": 1, "variant": "single", "max_step": null, "direction": "positive", "max_total": null, "wear_limit": 0.3, "zero_range": 0.001, "path_factor": 1.0, "tool_memory": 3, "wear_policy": "hold", "average_memory": 5, "plausible_jump": null, "averaging_limit": 0.005, "lower_deviation": null, "tolerance_width": 0.016, "upper_deviation": null, "confidence_limit": 1.0, "weighting_factor": 2.0, "rejected_may_correct": false}', '2025-11-23 01:03:35.900026+00', 'key command line', NULL),
	(1, 1, 2, '{"axis": "X", "mode": "automatic", "wait": null, "index": null, "accept": {"m": 1, "n": 1}, "factor": -1.0, "points": 1, "target": 40.0, "feature": "outside", "nominal": null, "repeats": 1, "variant": "single", "max_step": null, "direction": "positive", "max_total": null, "wear_limit": 0.3, "zero_range": 0.0015, "path_factor": 1.0, "tool_memory": 3, "wear_policy": "hold", "average_memory": 5, "plausible_jump": null, "averaging_limit": 0.005, "lower_deviation": null, "tolerance_width": 0.016, "upper_deviation": null, "confidence_limit": 1.0, "weighting_factor": 2.0, "rejected_may_correct": false}', '2025-11-23 01:03:50.307672+00', 'key command line', 'scatter of the new probe');
INSERT INTO public.person (id, name, role, password_hash, created_at, disabled_at) OVERRIDING SYSTEM VALUE VALUES
	(1, 'Ana', 'engineer', '$argon2id$v=19$m=65536,t=3,p=4$hmyEvtVON49IEem2JTne1A$W0uMUHFOQ/JmegJKLvgizD/iTDGbgRgnYMIv7i0oes0', '2025-11-23 01:04:48.163056+00', NULL);
INSERT INTO public.reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before, average_after, measured_at, received_at, machined_at, parameters_version, correction_in_effect, correction, paused_by, late, zone, action, code, key, part, outstanding, alarms, compensated) VALUES
	(1, 1, 1, 40.002806, 0.002806, 0.002806, 0, 0, '2025-11-23 01:03:49.627366+00', '2025-11-23 01:03:49.627366+00', NULL, 1, NULL, 1, NULL, false, 'average', 'correct', 'averaged_deviation', 'part-0', NULL, NULL, NULL, 0),
	(1, 1, 2, 39.999205, -0.000795, -0.000795, 0, -0.0003975, '2025-11-23 01:03:49.672275+00', '2025-11-23 01:03:49.672275+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-1', NULL, NULL, NULL, -0.001403),
	(1, 1, 3, 40.000474, 0.000474, 0.000474, -0.0003975, 3.824999999999998e-05, '2025-11-23 01:03:49.68037+00', '2025-11-23 01:03:49.68037+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-2', NULL, NULL, NULL, -0.001403),
	(1, 1, 4, 40.000176, 0.000176, 0.000176, 3.824999999999998e-05, 0.00010712499999999999, '2025-11-23 01:03:49.683624+00', '2025-11-23 01:03:49.683624+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-3', NULL, NULL, NULL, -0.001403),
	(1, 1, 5, 40.001002, 0.001002, 0.001002, 0.00010712499999999999, 0.0005545625, '2025-11-23 01:03:49.692855+00', '2025-11-23 01:03:49.692855+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-4', NULL, NULL, NULL, -0.001403),
	(1, 1, 6, 39.998317, -0.001683, -0.001683, 0.0005545625, -0.00056421875, '2025-11-23 01:03:49.697102+00', '2025-11-23 01:03:49.697102+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-5', NULL, NULL, NULL, -0.001403),
	(1, 1, 7, 39.999502, -0.000498, -0.000498, -0.00056421875, -0.000531109375, '2025-11-23 01:03:49.703257+00', '2025-11-23 01:03:49.703257+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-6', NULL, NULL, NULL, -0.001403),
	(1, 1, 8, 39.999098, -0.000902, -0.000902, -0.000531109375, -0.0007165546875, '2025-11-23 01:03:49.706564+00', '2025-11-23 01:03:49.706564+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-7', NULL, NULL, NULL, -0.001403),
	(1, 1, 9, 39.99871, -0.00129, -0.00129, -0.0007165546875, 0, '2025-11-23 01:03:49.708876+00', '2025-11-23 01:03:49.708876+00', NULL, 1, NULL, 2, NULL, false, 'average', 'correct', 'averaged_deviation', 'part-8', NULL, NULL, NULL, -0.001403),
	(1, 1, 10, 39.998987, -0.001013, -0.001013, 0, -0.0005065, '2025-11-23 01:03:49.730035+00', '2025-11-23 01:03:49.730035+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-9', NULL, NULL, NULL, -0.000399723),
	(1, 1, 11, 39.999385, -0.000615, -0.000615, -0.0005065, -0.00056075, '2025-11-23 01:03:49.737615+00', '2025-11-23 01:03:49.737615+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-10', NULL, NULL, NULL, -0.000399723),
	(1, 1, 12, 39.999656, -0.000344, -0.000344, -0.00056075, -0.00045237500000000003, '2025-11-23 01:03:49.740956+00', '2025-11-23 01:03:49.740956+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-11', NULL, NULL, NULL, -0.000399723),
	(1, 1, 13, 39.998912, -0.001088, -0.001088, -0.00045237500000000003, -0.0007701875, '2025-11-23 01:03:49.743638+00', '2025-11-23 01:03:49.743638+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-12', NULL, NULL, NULL, -0.000399723),
	(1, 1, 14, 40.000506, 0.000506, 0.000506, -0.0007701875, -0.00013209375, '2025-11-23 01:03:49.749214+00', '2025-11-23 01:03:49.749214+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-13', NULL, NULL, NULL, -0.000399723),
	(1, 1, 15, 39.999343, -0.000657, -0.000657, -0.00013209375, -0.00039454687500000004, '2025-11-23 01:03:49.753677+00', '2025-11-23 01:03:49.753677+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-14', NULL, NULL, NULL, -0.000399723),
	(1, 1, 16, 39.996163, -0.003837, -0.003837, -0.00039454687500000004, 0, '2025-11-23 01:03:49.756046+00', '2025-11-23 01:03:49.756046+00', NULL, 1, NULL, 3, NULL, false, 'average', 'correct', 'averaged_deviation', 'part-15', NULL, NULL, NULL, -0.000399723),
	(1, 1, 17, 40.001429, 0.001429, 0.001429, 0, 0.0007145, '2025-11-23 01:03:49.787331+00', '2025-11-23 01:03:49.787331+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-16', NULL, NULL, NULL, 0.00171605),
	(1, 1, 18, 39.99953, -0.00047, -0.00047, 0.0007145, 0.00012225, '2025-11-23 01:03:49.79461+00', '2025-11-23 01:03:49.79461+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-17', NULL, NULL, NULL, 0.00171605),
	(1, 1, 19, 39.999108, -0.000892, -0.000892, 0.00012225, -0.000384875, '2025-11-23 01:03:49.797886+00', '2025-11-23 01:03:49.797886+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-18', NULL, NULL, NULL, 0.00171605),
	(1, 1, 20, 40.000322, 0.000322, 0.000322, -0.000384875, -3.14375e-05, '2025-11-23 01:03:49.7997+00', '2025-11-23 01:03:49.7997+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-19', NULL, NULL, NULL, 0.00171605),
	(1, 1, 21, 40.000276, 0.000276, 0.000276, -3.14375e-05, 0.00012228125, '2025-11-23 01:03:49.803032+00', '2025-11-23 01:03:49.803032+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-20', NULL, NULL, NULL, 0.00171605),
	(1, 1, 22, 40.000063, 6.3e-05, 6.3e-05, 0.00012228125, 9.2640625e-05, '2025-11-23 01:03:49.81579+00', '2025-11-23 01:03:49.81579+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-21', NULL, NULL, NULL, 0.00171605),
	(1, 1, 23, 39.998975, -0.001025, -0.001025, 9.2640625e-05, -0.0004661796875, '2025-11-23 01:03:49.82717+00', '2025-11-23 01:03:49.82717+00', NULL, 1, NULL, NULL, NULL, false, 'average', 'none', 'average_kept', 'part-22', NULL, NULL, NULL, 0.00171605),
	(1, 1, 24, 40.00023, 0.00023, 0.00023, -0.0004661796875, -0.00011808984375, '2025-11-23 01:03:49.846213+00', '2025-11-23 01:03:49.846213+00', NULL, 1, NULL, NULL, NULL, false, 'zero', 'none', 'within_zero_range', 'part-23', NULL, NULL, NULL, 0.00171605),
	(1, 1, 25, 40.4, 0.4, 0.4, -0.00011808984375, -0.00011808984375, '2025-11-23 01:03:49.862267+00', '2025-11-23 01:03:49.862267+00', NULL, 1, NULL, 4, NULL, false, 'wear', 'hold', 'tool_worn_held', NULL, NULL, NULL, '{1}', 0.00171605),
	(1, 1, 26, 40.009, 0.009, 0.009, 0, 0, '2025-11-23 01:03:50.179963+00', '2025-11-23 01:03:50.179963+00', NULL, 1, NULL, 5, NULL, false, 'oversize', 'correct', 'out_of_tolerance', NULL, NULL, NULL, '{2}', 0),
	(1, 1, 27, 39.991, -0.009, -0.018, 0, 0, '2025-11-23 01:03:50.284927+00', '2025-11-23 01:03:50.284927+00', NULL, 1, NULL, 6, NULL, false, 'undersize', 'correct', 'out_of_tolerance', NULL, NULL, '{5}', '{3}', 0),
	(1, 1, 28, 0.015343846, -39.985656154, -39.985656154, 0, 0, '2025-11-21 08:15:02+00', '2025-11-23 01:03:51.386584+00', NULL, 2, NULL, NULL, NULL, true, 'probe_fault', 'stop', 'probe_fault', 'form:1:deviation', 'SN-000812', NULL, '{4}', 0);
INSERT INTO public.report_job (id, asked_by, asked_at, request, state, done, total, problems, current, taken_by, started_at, finished_at, finished_by, trouble, file_name, size) OVERRIDING SYSTEM VALUE VALUES
	(1, 'Ana', '2025-11-23 01:03:52.085329+00', '{"to": null, "from": null, "last": null, "paper": "a4", "format": "csv", "language": "en", "sections": ["numbers", "capability", "chart", "control", "wear", "corrections", "alarms", "tools", "parameters", "excluded", "decisions"], "timezone": "UTC", "characteristics": ["shaft-d40"]}', 'cancelled', 1, 1, 0, NULL, '8dbf40d7f0d64041ab65f0ebafc4e77a', '2025-11-23 01:03:54.165945+00', '2025-11-23 01:03:54.797149+00', 'Ana', NULL, NULL, NULL);
INSERT INTO public.result_reading (machine_id, characteristic_id, key, measured, measured_at, part, asked_at, sequence, refused) VALUES
	(1, 1, 'form:1:deviation', 0.015343846, '2025-11-21 08:15:02+00', 'SN-000812', '2025-11-23 01:03:51.200803+00', 28, NULL);
INSERT INTO public.stream (machine_id, characteristic_id, sequence, parameters_version, tool_memory, average_memory, paused_by, sequence_at_tool_change, last_measured_at, last_received_at, last_measured, last_deviation, last_average, last_zone, level, level_sequence) VALUES
	(1, 1, 28, 2, 3, 5, 4, 25, '2025-11-23 01:03:50.284927+00', '2025-11-23 01:03:51.386584+00', 0.015343846, -39.985656154, 0, 'probe_fault', NULL, NULL);
INSERT INTO public.tool (machine_id, number, "offset", total, changed_at, reset_at, paused_by, parts_kept, edge, name, kind, planned_parts, planned_total, sister, life_told) VALUES
	(1, 1, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 2, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 4, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 5, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 6, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 7, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 8, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 9, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 10, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 11, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 12, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 13, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 14, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 15, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 16, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 17, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 18, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 19, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 20, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 21, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 22, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 23, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 24, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 25, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 26, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 27, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 28, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 29, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 30, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 31, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 32, 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false),
	(1, 3, -0.012, 0, '2025-11-23 01:03:50.104851+00', '2025-11-23 01:03:50.530551+00', NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, false);
INSERT INTO public.tool_event (machine_id, id, number, at, kind, offset_before, offset_after, correction, parts, actor, reason, total, edge, name) OVERRIDING SYSTEM VALUE VALUES
	(1, 1, 3, '2025-11-23 01:03:49.650776+00', 'correction', 0, -0.001403, 1, NULL, 'lathe-1 (key lathe-1)', NULL, NULL, NULL, NULL),
	(1, 2, 3, '2025-11-23 01:03:49.720152+00', 'correction', -0.001403, -0.000399723, 2, NULL, 'lathe-1 (key lathe-1)', NULL, NULL, NULL, NULL),
	(1, 3, 3, '2025-11-23 01:03:49.767483+00', 'correction', -0.000399723, 0.00171605, 3, NULL, 'lathe-1 (key lathe-1)', NULL, NULL, NULL, NULL),
	(1, 4, 3, '2025-11-23 01:03:50.104851+00', 'change', 0.00171605, 0, NULL, 25, 'key command line', 'New insert', 0.00171605, NULL, NULL),
	(1, 5, 3, '2025-11-23 01:03:50.530551+00', 'edit', 0, -0.012, NULL, NULL, 'key command line', 'set at the control', NULL, NULL, NULL);
INSERT INTO public.watching (machine_id, characteristic_id, baseline_version, rules_version, begun, looked, pointed, excluded, memory, at) VALUES
	(1, 1, 1, 0, 28, 28, 27, 0, '{"main": {"rules": [{"scan": {"last": 0.0, "rules": {"nelson_1": {"runs": [], "state": [[0, 0, 0, 0], [0, 0, 0, 0]]}}, "length": 0}, "begun": [], "firsts": []}], "points": {"seen": 3, "state": [], "waiting": [], "waiting_at": 0}}}', '2025-11-23 01:04:50.414742+00');
INSERT INTO public.work_zero (machine_id, id, kind, fixture, work_offset, part, touched_at, received_at, actor, key, given, x, y, z, rotation, diameter, length, width, result, recomputed_from) VALUES
	(1, 1, 'pocket', 'vice-left', 'G54', 'SN-000812', '2025-11-21 06:02:11+00', '2025-11-23 01:03:50.699168+00', 'key command line', NULL, '{"tip": 6.0, "feeler": 0.1, "touches": [{"x": -353.012, "approach": "-X"}, {"x": -259.008, "approach": "+X"}, {"y": -181.254, "approach": "-Y"}, {"y": -127.246, "approach": "+Y"}], "z_touched": -201.5, "tool_length": 98.25, "repeatability": 0.001}', -306.01, -154.25, -299.85, NULL, NULL, 100.004, 60.008, '{"notices": [], "residuals": [0.0, 0.0, 0.0, 0.0], "squareness": null, "uncertainty": {"x": 0.0014142135620180984, "y": 0.001414213562420042, "width": 0.002828427124840084, "length": 0.002828427124036197}}', NULL);
SELECT pg_catalog.setval('public.alarm_id', 4, true);
SELECT pg_catalog.setval('public.alignment_id', 1, true);
SELECT pg_catalog.setval('public.api_key_id_seq', 3, true);
SELECT pg_catalog.setval('public.audit_entry_id_seq', 19, true);
SELECT pg_catalog.setval('public.characteristic_id_seq', 1, true);
SELECT pg_catalog.setval('public.event_id_seq', 54, true);
SELECT pg_catalog.setval('public.form_id', 1, true);
SELECT pg_catalog.setval('public.gauge_study_id_seq', 2, true);
SELECT pg_catalog.setval('public.hand_measurement_id_seq', 1, true);
SELECT pg_catalog.setval('public.kinematics_run_id', 1, true);
SELECT pg_catalog.setval('public.login_failure_id_seq', 1, false);
SELECT pg_catalog.setval('public.machine_id_seq', 1, true);
SELECT pg_catalog.setval('public.paired_reading_id_seq', 1, true);
SELECT pg_catalog.setval('public.parameter_proposal_id_seq', 1, false);
SELECT pg_catalog.setval('public.person_id_seq', 1, true);
SELECT pg_catalog.setval('public.report_job_id_seq', 1, true);
SELECT pg_catalog.setval('public.signal_id', 1, false);
SELECT pg_catalog.setval('public.tool_event_id_seq', 5, true);
SELECT pg_catalog.setval('public.work_zero_id', 1, true);

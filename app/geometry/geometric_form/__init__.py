"""Form and position of features, measured on the machine: from touches to deviation, verdict, pictures and a trend.

Every measurement keeps its touches. What was found is kept beside them as an evaluation, and can be found again by newer
code; the newest evaluation is the one that counts. The result may become a reading of a characteristic, so that charts,
alarms and reports work on it.
"""

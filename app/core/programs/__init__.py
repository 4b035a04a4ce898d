"""Program text of the controls: read, and written so that it can be read again. One file per control.

lines             what all of them share: verdicts per line, programs found, numbers, what R text cannot say
sinumerik         `L05` and `L15`, R assignments, the later names such as `_TZL`
fanuc             the macro variables of the lathe line, #500 to #513
corrections       pending corrections as text that changes nothing when it is run twice
correction_forms  the forms of that text
ring_settings     what the programs of the ring are written with: control, registers, limits
ring_steps        those programs step by step, in no control's words; ring_dialects and one file per control put them into words
ring_texts        the texts of them
frames            work zeros and alignments: settable and programmable frames, G10, G68, cycles 7 and 10
"""

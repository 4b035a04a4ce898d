"""The bridge: one process beside machines that cannot speak REST.

It fetches readings from the controls, keeps them durably, sends them to the server, and brings corrections back. It speaks
the public API through ``inband_client`` and imports nothing of the server.

    configuration    one TOML file: the server, the machines, what each number of a control means
    links            what a kind of control has to do for the bridge, and how it says what failed
    registers        ring, mailbox and direct writes, for every control whose registers can be read and written
    moments          when something was measured, by a control's clock
    json_text        JSON of others, without what cannot be sent on
    kinds            the protocols, one module each
    store            readings kept until the server has them, corrections on their way, the quarantine: SQLite
    store_tables     its tables, and what is read out of them
    guards           the bridge's own limits for a correction, whatever the server says
    control_side     the task that talks to one control
    server_side      the task that talks to the server for one machine
    proving          the touch test of one location at the command line; proving_by_page: with a person's answers at the page
    loops            the event loop, and how signals end it
    program          all machines together, each with its own tasks
"""

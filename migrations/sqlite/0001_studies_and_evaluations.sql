-- The first schema. Times are milliseconds since 1970-01-01 UTC by the database's clock. JSON is stored as text.
-- Forward-only: once released this file never changes; a change is a new file.

-- One row per submitted study.
CREATE TABLE studies (
    number          INTEGER PRIMARY KEY AUTOINCREMENT, -- order of submission; the cursor of lists
    id              TEXT    NOT NULL UNIQUE,           -- public id
    name            TEXT    NOT NULL,                  -- the document's name
    document        TEXT    NOT NULL,                  -- the document as submitted, JSON
    fingerprint     TEXT    NOT NULL,                  -- hash of the resolved document
    -- queued: no evaluation was claimed yet | running | paused: nothing is handed out | cancelling: evaluations are
    -- still out | cancelled | done: every step ended | failed: an optimiser broke, see failure
    state           TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'paused', 'cancelling', 'cancelled', 'done', 'failed')),
    failure         TEXT,                              -- why the study failed
    step            BIGINT  NOT NULL,                  -- index of the step in progress; the number of steps when done
    steps           BIGINT  NOT NULL,                  -- number of steps
    priority        BIGINT  NOT NULL DEFAULT 0,        -- higher goes first
    mixed_hardware  BIGINT  NOT NULL,                  -- 1: workers of any build and instruction set may join
    build           TEXT,                              -- solver build of the first worker; the others must match
    instruction_set TEXT,                              -- instruction set of the first worker
    idempotency_key TEXT    UNIQUE,                    -- the Idempotency-Key of the submission
    body_sha256     TEXT    NOT NULL,                  -- hash of the submitted body, to tell a repeat from a clash
    created_ms      BIGINT  NOT NULL,                  -- submitted
    started_ms      BIGINT,                            -- first claim
    ended_ms        BIGINT                             -- done, failed or cancelled
);

-- One row per restart of a step: its optimiser's state, which only the core reads.
CREATE TABLE restarts (
    id              INTEGER PRIMARY KEY AUTOINCREMENT, -- id
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    step            BIGINT  NOT NULL,                  -- index of its step
    restart_index   BIGINT  NOT NULL,                  -- index in the step
    state           TEXT    NOT NULL CHECK (state IN ('running', 'done')), -- running: asks are out | done: the optimiser stopped
    machine         TEXT    NOT NULL,                  -- the optimiser's state, JSON
    version         BIGINT  NOT NULL,                  -- + 1 at every step; guards the save of a step
    batch           BIGINT  NOT NULL,                  -- number of the batch that is out
    summary         TEXT    NOT NULL,                  -- what the core says of the restart, JSON
    started_ms      BIGINT  NOT NULL,                  -- begun
    ended_ms        BIGINT,                            -- done
    UNIQUE (study, step, restart_index)
);
CREATE INDEX restarts_running ON restarts (study) WHERE state = 'running';

-- One row per evaluation asked for; never changed.
CREATE TABLE evaluations (
    id              INTEGER PRIMARY KEY AUTOINCREMENT, -- id
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    restart         BIGINT  NOT NULL REFERENCES restarts (id), -- its restart
    batch           BIGINT  NOT NULL,                  -- batch of the restart
    batch_index     BIGINT  NOT NULL,                  -- place in the batch: results go to the optimiser in this order
    request         TEXT    NOT NULL,                  -- what is asked, JSON
    result_key      TEXT    NOT NULL,                  -- hash of model, mesh plan, settings, design bits and what is wanted
    created_ms      BIGINT  NOT NULL,                  -- asked
    UNIQUE (restart, batch, batch_index)
);
CREATE INDEX evaluations_by_study ON evaluations (study, id);

-- The hot table: one row per evaluation that is not answered yet.
CREATE TABLE queue (
    evaluation      INTEGER PRIMARY KEY REFERENCES evaluations (id), -- the evaluation
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    state           TEXT    NOT NULL CHECK (state IN ('ready', 'leased')), -- ready: wants a worker | leased: a worker has it until lease_until_ms
    command         BIGINT  NOT NULL,                  -- 1: only for workers that may start programs
    fence           BIGINT  NOT NULL,                  -- + 1 at every claim; a report must carry it
    attempt         BIGINT  NOT NULL,                  -- number of claims that count against the cap
    lease_until_ms  BIGINT,                            -- end of the lease
    worker          TEXT                               -- id of the worker that has it
);
CREATE INDEX queue_ready ON queue (study, evaluation) WHERE state = 'ready';
CREATE INDEX queue_leased ON queue (study, lease_until_ms) WHERE state = 'leased';

-- One row per answered evaluation; append-only.
CREATE TABLE results (
    evaluation      INTEGER PRIMARY KEY REFERENCES evaluations (id), -- the evaluation
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    -- ok | infeasible_geometry | no_equilibrium | not_converged: ours | invalid_result: the worker reported nonsense
    -- failed: a program | work_limit | cancelled | lost: the lease expired more often than the cap
    status          TEXT    NOT NULL CHECK (status IN ('ok', 'infeasible_geometry', 'no_equilibrium', 'not_converged', 'invalid_result', 'failed', 'work_limit', 'cancelled', 'lost')),
    outcome         TEXT    NOT NULL,                  -- the outcome, JSON
    objective       DOUBLE,                            -- null where the status is not ok
    max_violation   DOUBLE,                            -- largest violation of a constraint, 0 when none; null likewise
    feasible        BIGINT  NOT NULL,                  -- 1: within the optimiser's violation tolerance
    overlap         BIGINT  NOT NULL,                  -- 1: walls cross somewhere on the path
    counts          BIGINT  NOT NULL,                  -- 1: may be a best point: feasible, free of overlap, on a stable branch
    result_key      TEXT    NOT NULL,                  -- as in evaluations
    cached_from     BIGINT,                            -- the evaluation that paid for this result; null: this one did
    wall_s          DOUBLE  NOT NULL,                  -- wall time; of the payer where cached
    cpu_s           DOUBLE  NOT NULL,                  -- CPU time; of the payer where cached
    worker          TEXT,                              -- worker; null: the coordinator (lost)
    build           TEXT,                              -- solver build of the worker
    instruction_set TEXT,                              -- instruction set of the worker
    fence           BIGINT  NOT NULL,                  -- fence of the accepted report
    attempt         BIGINT  NOT NULL,                  -- attempt of the accepted report
    finished_ms     BIGINT  NOT NULL                   -- stored
);
CREATE INDEX results_by_key ON results (result_key) WHERE cached_from IS NULL;
CREATE INDEX results_by_study ON results (study, evaluation);

-- What happened, for watchers; append-only. The id is the event id of the stream.
CREATE TABLE events (
    id              INTEGER PRIMARY KEY AUTOINCREMENT, -- event id
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    -- state: the study's state changed | evaluation: one was answered | restart: one began or ended | step: one ended
    kind            TEXT    NOT NULL CHECK (kind IN ('state', 'evaluation', 'restart', 'step')),
    data            TEXT    NOT NULL,                  -- JSON
    created_ms      BIGINT  NOT NULL                   -- when
);
CREATE INDEX events_by_study ON events (study, id);

-- Workers that have claimed something, for people.
CREATE TABLE workers (
    id              TEXT    PRIMARY KEY,               -- id that the worker gave itself
    host            TEXT    NOT NULL,                  -- host name
    pid             BIGINT  NOT NULL,                  -- process id
    build           TEXT    NOT NULL,                  -- solver build
    instruction_set TEXT    NOT NULL,                  -- instruction set
    first_seen_ms   BIGINT  NOT NULL,                  -- first claim
    last_seen_ms    BIGINT  NOT NULL,                  -- last claim, heartbeat or report
    evaluations     BIGINT  NOT NULL,                  -- results accepted from it
    draining        BIGINT  NOT NULL DEFAULT 0         -- 1: it ends after its evaluation and gets no other
);

-- Two outcomes that the first schema does not know: no_margin and not_unique. A CHECK is changed by building the table anew.
CREATE TABLE results_with_limits (
    evaluation      INTEGER PRIMARY KEY REFERENCES evaluations (id), -- the evaluation
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    -- ok | infeasible_geometry | no_equilibrium | no_margin: no stable equilibrium at the load margin
    -- not_unique: a second equilibrium was met | not_converged: ours | invalid_result: the worker reported nonsense
    -- failed: a program | work_limit | cancelled | lost: the lease expired more often than the cap
    status          TEXT    NOT NULL CHECK (status IN ('ok', 'infeasible_geometry', 'no_equilibrium', 'no_margin', 'not_unique', 'not_converged', 'invalid_result', 'failed', 'work_limit', 'cancelled', 'lost')),
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
INSERT INTO results_with_limits SELECT * FROM results;
DROP TABLE results;
ALTER TABLE results_with_limits RENAME TO results;
CREATE INDEX results_by_key ON results (result_key) WHERE cached_from IS NULL;
CREATE INDEX results_by_study ON results (study, evaluation);

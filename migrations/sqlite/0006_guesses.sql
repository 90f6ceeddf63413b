-- Guesses: what an optimiser will probably ask next, evaluated by workers that nothing else needs. Their results are known results
-- for what is asked later, and nothing else: no optimiser waits for them, no curve shows them, no study ends later for them.

-- 1: a guess. It belongs to the restart for which it was made and has the batch -2 - that of the restart then, which neither an
-- optimiser nor a band has. One that nobody claimed before its restart went on is deleted.
ALTER TABLE evaluations ADD COLUMN guess BIGINT NOT NULL DEFAULT 0;

-- A CHECK is changed by building the table anew. One row per evaluation that is not answered yet.
CREATE TABLE queue_with_guesses (
    evaluation      INTEGER PRIMARY KEY REFERENCES evaluations (id), -- the evaluation
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    state           TEXT    NOT NULL CHECK (state IN ('ready', 'leased')), -- ready: wants a worker | leased: a worker has it until lease_until_ms
    command         BIGINT  NOT NULL,                  -- 1: only for workers that may start programs
    fence           BIGINT  NOT NULL,                  -- + 1 at every claim; a report must carry it
    attempt         BIGINT  NOT NULL,                  -- number of claims that count against the cap
    lease_until_ms  BIGINT,                            -- end of the lease
    worker          TEXT,                              -- id of the worker that has it
    -- optimiser: an optimiser waits for it; held back while a guess with the same key is leased | band: handed out only while
    -- no evaluation of any optimiser is ready | guess: handed out only while no band is ready either
    kind            TEXT    NOT NULL DEFAULT 'optimiser' CHECK (kind IN ('optimiser', 'band', 'guess')),
    place           BIGINT  NOT NULL DEFAULT 0         -- handed out first within a study
);
INSERT INTO queue_with_guesses (evaluation, study, state, command, fence, attempt, lease_until_ms, worker, kind, place)
SELECT evaluation, study, state, command, fence, attempt, lease_until_ms, worker, kind, place FROM queue;
DROP TABLE queue;
ALTER TABLE queue_with_guesses RENAME TO queue;
CREATE INDEX queue_ready ON queue (study, kind, place, evaluation) WHERE state = 'ready';
CREATE INDEX queue_leased ON queue (study, lease_until_ms) WHERE state = 'leased';

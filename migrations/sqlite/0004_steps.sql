-- Steps take results of each other and run side by side: each has a row of its own, where a study knew the one in progress.

CREATE TABLE steps (
    study           TEXT    NOT NULL REFERENCES studies (id), -- its study
    step            BIGINT  NOT NULL,                  -- index in the study
    -- waiting: what it takes is not there yet | running: restarts are under way | done: every restart ended
    -- blocked: what it takes will never be there, see result
    state           TEXT    NOT NULL CHECK (state IN ('waiting', 'running', 'done', 'blocked')),
    inputs          TEXT,                              -- what it took from other steps, JSON; null before it began
    result          TEXT,                              -- done: what it hands on, JSON | blocked: {"reason": ...}
    began_ms        BIGINT,                            -- begun
    ended_ms        BIGINT,                            -- done or blocked
    PRIMARY KEY (study, step)
);

-- Studies of before: their steps took nothing and followed each other in the document's order.
INSERT INTO steps (study, step, state, inputs, result)
WITH RECURSIVE indices (study, step, current, count) AS (
    SELECT id, 0, step, steps FROM studies WHERE steps > 0
    UNION ALL
    SELECT study, step + 1, current, count FROM indices WHERE step + 1 < count
)
SELECT study, step,
       CASE WHEN step < current THEN 'done' WHEN step = current THEN 'running' ELSE 'waiting' END,
       CASE WHEN step <= current THEN '{}' END,
       CASE WHEN step < current THEN '{"candidates":[]}' END
FROM indices;

ALTER TABLE studies DROP COLUMN step;
ALTER TABLE studies DROP COLUMN steps;

-- Error bands: a design that became the best so far is evaluated on a second mesh too, in the same queue, after all else.

-- The evaluation whose band this is; null: an optimiser asked. A band belongs to the restart of that evaluation and has the
-- batch -1, which no optimiser has, and as its place in it that evaluation's id.
ALTER TABLE evaluations ADD COLUMN band_of BIGINT REFERENCES evaluations (id);
-- One band an evaluation.
CREATE UNIQUE INDEX evaluations_band_of ON evaluations (band_of) WHERE band_of IS NOT NULL;

-- optimiser: an optimiser waits for it | band: handed out only while no evaluation of any optimiser is ready
ALTER TABLE queue ADD COLUMN kind TEXT NOT NULL DEFAULT 'optimiser' CHECK (kind IN ('optimiser', 'band'));
DROP INDEX queue_ready;
CREATE INDEX queue_ready ON queue (study, kind, evaluation) WHERE state = 'ready';

-- Whether a result is the best so far of its step is asked whenever one that counts is stored.
CREATE INDEX results_that_count ON results (study, objective) WHERE counts = 1;

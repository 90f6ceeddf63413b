-- Restarts that compete: one of them may wait, with nothing asked, until it is decided whether it goes on.

-- 1: it runs, and waits for a decision that follows from the restarts of lower index | 0: its batch is out, or it is done
ALTER TABLE restarts ADD COLUMN waits BIGINT NOT NULL DEFAULT 0;

-- What is handed out first within a study: of restarts that compete their index, since the later ones wait for the earlier ones.
ALTER TABLE queue ADD COLUMN place BIGINT NOT NULL DEFAULT 0;
DROP INDEX queue_ready;
CREATE INDEX queue_ready ON queue (study, kind, place, evaluation) WHERE state = 'ready';

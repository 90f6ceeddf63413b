//! Guesses: what workers evaluate that nothing else needs. They fill the store of known results and bind nobody: a guess is
//! withdrawn when its restart goes on, forgotten when its worker dies, and no study waits for one.

use salp_protocol::StudyId;
use salp_server::store::{NewAsk, StoreError};

use crate::rows::{Tx, database, to_json};
use crate::submit::Owner;

const DOING: &str = "queue a guess";

/// Withdraws the guesses of a restart that nobody has claimed, and queues others. What is queued already in the study is not
/// queued again.
pub async fn replace_guesses(
    tx: &mut Tx,
    owner: &Owner<'_>,
    batch: i64,
    guesses: Vec<NewAsk>,
    now: i64,
) -> Result<(), StoreError> {
    withdraw_unclaimed(tx, owner.restart).await?;
    for (place, guess) in guesses.into_iter().enumerate() {
        let queued = sqlx::query_scalar!(
            r#"SELECT EXISTS (SELECT 1 FROM queue q JOIN evaluations e ON e.id = q.evaluation
                              WHERE q.study = ? AND e.result_key = ?) AS "queued!: i64""#,
            owner.study.0,
            guess.key
        )
        .fetch_one(&mut **tx)
        .await
        .map_err(database(DOING))?;
        if queued != 0 || guess.known.is_some() {
            continue;
        }
        let (of, place) = (-2 - batch, place as i64);
        let request = to_json("request", &guess.request)?;
        let id = sqlx::query_scalar!(
            r#"INSERT INTO evaluations (study, restart, batch, batch_index, request, result_key, created_ms, guess)
               VALUES (?, ?, ?, ?, ?, ?, ?, 1) RETURNING id AS "id!: i64""#,
            owner.study.0,
            owner.restart,
            of,
            place,
            request,
            guess.key,
            now
        )
        .fetch_one(&mut **tx)
        .await
        .map_err(database(DOING))?;
        sqlx::query!(
            "INSERT INTO queue (evaluation, study, state, command, fence, attempt, kind, place)
             VALUES (?, ?, 'ready', ?, 0, 0, 'guess', ?)",
            id,
            owner.study.0,
            guess.command,
            guess.place
        )
        .execute(&mut **tx)
        .await
        .map_err(database(DOING))?;
    }
    Ok(())
}

async fn withdraw_unclaimed(tx: &mut Tx, restart: i64) -> Result<(), StoreError> {
    let unclaimed = sqlx::query_scalar!(
        r#"SELECT q.evaluation AS "evaluation!: i64" FROM queue q JOIN evaluations e ON e.id = q.evaluation
           WHERE e.restart = ? AND q.kind = 'guess' AND q.state = 'ready'"#,
        restart
    )
    .fetch_all(&mut **tx)
    .await
    .map_err(database(DOING))?;
    for evaluation in unclaimed {
        sqlx::query!("DELETE FROM queue WHERE evaluation = ?", evaluation)
            .execute(&mut **tx)
            .await
            .map_err(database(DOING))?;
        sqlx::query!("DELETE FROM evaluations WHERE id = ?", evaluation)
            .execute(&mut **tx)
            .await
            .map_err(database(DOING))?;
    }
    Ok(())
}

/// Forgets the guesses whose workers let their leases expire.
pub async fn forget_expired(tx: &mut Tx, now: i64) -> Result<(), StoreError> {
    sqlx::query!(
        "DELETE FROM queue WHERE kind = 'guess' AND state = 'leased' AND lease_until_ms <= ?",
        now
    )
    .execute(&mut **tx)
    .await
    .map_err(database("forget guesses"))?;
    Ok(())
}

/// Forgets every guess of a study that ends; a worker that has one learns of it by its next heartbeat.
pub async fn forget_all(tx: &mut Tx, study: &StudyId) -> Result<(), StoreError> {
    sqlx::query!(
        "DELETE FROM queue WHERE study = ? AND kind = 'guess'",
        study.0
    )
    .execute(&mut **tx)
    .await
    .map_err(database("forget guesses"))?;
    Ok(())
}

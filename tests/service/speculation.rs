//! Workers that nothing else needs evaluate what an optimiser will probably ask: nothing changes but the time.

use std::time::Duration;

use salp_protocol::{GuessCounts, StudyView};
use serde_json::{Value, json};

use super::support::{Folder, Process, serve, study, undisturbed_of, until, work};

/// One restart with differences in three variables.
fn document(pause_s: f64, speculate: bool) -> Value {
    let mut document = study(pause_s);
    document["speculate"] = json!(speculate);
    document["step"][0]["restarts"]["points"] = json!([[0.3, 0.2, -0.1]]);
    document
}

/// Runs the study; how it ended, its histories, and what its optimiser was told.
fn run(pause_s: f64, speculate: bool, workers: usize) -> (StudyView, Vec<String>, Vec<Vec<f64>>) {
    let folder = Folder::new("speculation");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let start = |_| work(&folder, &coordinator.url, &[]);
    let _workers: Vec<Process> = (0..workers).map(start).collect();
    let id = coordinator.submit(&document(pause_s, speculate));
    let view = coordinator.until_done(&id);
    let ledger = coordinator.ledger(&id);
    let own = ledger.into_iter().filter(|row| row.kind != "guess");
    let points = own.map(|row| row.x).collect();
    (view, coordinator.histories(&id), points)
}

#[test]
fn the_history_is_the_same_with_guesses_and_without() {
    let (plain, history, points) = run(0.05, false, 1);
    assert_eq!(plain.counts.guesses, GuessCounts::default());
    // One worker has no time for guesses.
    let (alone, same, same_points) = run(0.05, true, 1);
    assert_eq!(alone.counts.guesses, GuessCounts::default());
    assert_eq!((&same, &same_points), (&history, &points));
    let (many, same, same_points) = run(0.05, true, 4);
    let guesses = many.counts.guesses;
    assert!(
        guesses.used > 0 && guesses.used <= guesses.answered,
        "{guesses:?}"
    );
    assert_eq!((&same, &same_points), (&history, &points));
    assert_eq!(many.counts.answered, plain.counts.answered);
}

#[test]
fn a_worker_killed_with_a_guess_changes_nothing() {
    let folder = Folder::new("speculation-killed");
    let coordinator = serve(&folder, "127.0.0.1:0", &["--lease", "1"]);
    let mut workers: Vec<Process> = (0..3)
        .map(|_| work(&folder, &coordinator.url, &[]))
        .collect();
    let id = coordinator.submit(&document(0.15, true));
    let mut killed = None;
    until("a worker has a guess", Duration::from_secs(20), || {
        let ledger = coordinator.ledger(&id);
        let guess = ledger
            .into_iter()
            .find(|row| row.kind == "guess" && row.status == "leased");
        killed = guess.filter(|guess| {
            let holder = guess.worker.as_ref().map_or("", |worker| &worker.0);
            let mut has = workers
                .iter_mut()
                .filter(|worker| holder.contains(&format!("-{}-", worker.id())));
            has.next().map(Process::kill).is_some()
        });
        killed.is_some()
    });
    coordinator.until_done(&id);
    let killed = killed.unwrap();
    let ledger = coordinator.ledger(&id);
    let row = ledger
        .iter()
        .find(|row| row.evaluation == killed.evaluation);
    // Between the look at the ledger and the end of its worker it may have been answered.
    let status = row.map(|row| row.status.as_str());
    assert!(matches!(status, Some("withdrawn" | "ok")), "{status:?}");
    assert_eq!(
        coordinator.histories(&id),
        undisturbed_of(&document(0.0, false))
    );
}

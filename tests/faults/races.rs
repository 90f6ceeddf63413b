//! Restarts that compete, while processes are killed.

use std::time::Duration;

use salp_protocol::StudyState;

use super::LEASE;
use super::support::{Folder, assert_sound, race, serve, undisturbed_of, until, work};

#[test]
fn a_race_goes_on_whoever_is_killed() {
    let folder = Folder::new("race-killed");
    let mut coordinator = serve(&folder, "127.0.0.1:0", LEASE);
    let address = coordinator.url.trim_start_matches("http://").to_owned();
    let mut first = work(&folder, &coordinator.url, &[]);
    let _second = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(&race(0.01));
    for (k, answered) in [6, 14, 22, 30, 38, 46].into_iter().enumerate() {
        until("some more are answered", Duration::from_secs(30), || {
            let view = coordinator.view(&id);
            view.counts.answered >= answered || view.state == StudyState::Done
        });
        coordinator.process.kill();
        if k == 2 {
            first.kill();
        }
        coordinator = serve(&folder, &address, LEASE);
    }
    let view = coordinator.until_done(&id);
    assert_sound(&coordinator.ledger(&id));
    let race_of = view.steps[0].race.as_ref().unwrap();
    let up = &race_of.rungs[0];
    assert!(up.promoted.len() < up.reached);
    assert_eq!(coordinator.histories(&id), undisturbed_of(&race(0.0)));
}

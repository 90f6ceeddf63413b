//! The decisions on records made by hand.

use super::*;
use crate::scene::Orientation;
use crate::study::restart::StudyStop;

fn near(a: &[f64], b: &[f64]) -> f64 {
    (a[0] - b[0]).abs()
}

fn competition(eta: usize) -> Competition {
    Competition {
        race: Some(Race {
            rungs: vec![Rung {
                evaluations: 4,
                mesh: 0.5,
                load_steps_per_leg: None,
            }],
            eta,
            least_correlation: 0.5,
            tolerance: 0.1,
        }),
        ..Competition::default()
    }
}

fn checked(rule: DominationRule) -> Competition {
    let stop = StopDominated {
        rule,
        ..StopDominated::default()
    };
    Competition {
        stop_dominated: Some(stop),
        ..Competition::default()
    }
}

fn mark(gate: Gate, merit: Merit, x: f64) -> Mark {
    Mark {
        gate,
        evaluations: 4,
        x: vec![x],
        merit,
        next: None,
        decision: None,
    }
}

/// A restart at the end of the first rung; each far from the others.
fn at_rung(objective: f64) -> RaceRecord {
    RaceRecord {
        marks: vec![mark(
            Gate::Rung(0),
            Merit::Feasible(objective),
            100.0 * objective,
        )],
        ..RaceRecord::default()
    }
}

fn promoted(decisions: &[(usize, Decision)]) -> Vec<usize> {
    let up = decisions.iter().filter(|(_, d)| d.stop.is_none());
    up.map(|(index, _)| *index).collect()
}

#[test]
fn a_third_goes_up_by_rank_among_the_restarts_before() {
    let merits = [5.0, 3.0, 4.0, 3.5, 9.0, 1.0, 2.0, 8.0, 0.5];
    let records: Vec<_> = merits.iter().map(|m| at_rung(*m)).collect();
    let decisions = due(&competition(3), &records[..8], &near);
    assert_eq!(promoted(&decisions), [0, 1, 3, 5, 6]);
    let stop = decisions[2].1.stop;
    let expected = StudyStop::NotPromoted {
        rung: 0,
        rank: 1,
        of: 3,
        places: 1,
    };
    assert_eq!(stop, Some(expected));
    // The ninth waits for values at the next fidelity, of the eight before it.
    let mut all = records.clone();
    assert_eq!(due(&competition(3), &all, &near), decisions);
    for (index, decision) in &decisions {
        all[*index].out = decision.stop.is_some();
        all[*index].marks[0].decision = Some(decision.clone());
        all[*index].marks[0].next = Some(all[*index].marks[0].merit);
    }
    let ninth = due(&competition(3), &all, &near);
    assert_eq!(promoted(&ninth), [8]);
    let correlation = ninth[0].1.correlation.expect("five went up");
    assert_eq!((correlation.pairs, correlation.spearman), (5, Some(1.0)));
}

#[test]
fn nobody_is_decided_before_the_restarts_of_lower_index() {
    let mut records = vec![RaceRecord::default(), at_rung(1.0), at_rung(2.0)];
    assert!(due(&competition(3), &records, &near).is_empty());
    records[0].out = true;
    assert_eq!(due(&competition(3), &records, &near).len(), 2);
    records[0] = at_rung(9.0);
    let decisions = due(&competition(3), &records, &near);
    assert_eq!(promoted(&decisions), [0, 1]);
}

#[test]
fn a_race_whose_fidelities_disagree_is_off_for_good() {
    let mut records: Vec<_> = (0..8).map(|k| at_rung(-f64::from(k))).collect();
    for (k, record) in records.iter_mut().enumerate() {
        let decision = Decision {
            rank: 0,
            of: k + 1,
            correlation: None,
            race_off: false,
            stop: None,
        };
        record.marks[0].decision = Some(decision);
        // The next fidelity's order is the reverse.
        record.marks[0].next = Some(Merit::Feasible(k as f64));
    }
    records.extend((0..12).map(|k| at_rung(10.0 + f64::from(k))));
    let decisions = due(&competition(3), &records, &near);
    let (index, first) = &decisions[0];
    assert_eq!((*index, first.race_off), (8, true));
    assert_eq!(first.correlation.and_then(|c| c.spearman), Some(-1.0));
    // The rest of the block; the next one waits for the eight of this block, which all go up now.
    assert_eq!(promoted(&decisions), (8..16).collect::<Vec<_>>());
    for (index, decision) in decisions {
        let mark = &mut records[index].marks[0];
        mark.decision = Some(decision);
        mark.next = Some(mark.merit);
    }
    // By now they would agree well enough: what is off stays off.
    let decisions = due(&competition(3), &records, &near);
    let later = decisions[0].1.correlation.expect("sixteen went up");
    assert!(later.spearman.expect("they differ") > 0.5, "{later:?}");
    assert_eq!(promoted(&decisions), (16..20).collect::<Vec<_>>());
    assert!(decisions.iter().all(|(_, d)| d.race_off));
    let summary = RaceSummary::of(&competition(3), &records).expect("they compete");
    assert_eq!(summary.rungs[0].off_from, Some(8));
}

#[test]
fn a_bound_gives_up_what_its_recent_gain_does_not_save() {
    let at_check = |first: f64, opened: f64| RaceRecord {
        opened: Some(Merit::Feasible(opened)),
        marks: vec![mark(Gate::Check(1), Merit::Feasible(first), 0.0)],
        ..RaceRecord::default()
    };
    let best = at_check(-10.0, 0.0);
    let options = checked(DominationRule::Bound);
    let stops = |other: RaceRecord| {
        let decisions = due(&options, &[best.clone(), other], &near);
        assert_eq!(decisions[0].1.stop, None);
        decisions[1].1.stop
    };
    // Two more checks at its recent gain: -2 - 2 * 2 and -4 - 2 * 4.
    let Some(StudyStop::Dominated { bound, .. }) = stops(at_check(-2.0, 0.0)) else {
        panic!("it is dominated");
    };
    assert_eq!(bound, Merit::Feasible(-6.0));
    assert_eq!(stops(at_check(-4.0, 0.0)), None);
    // What has only just become feasible may go anywhere.
    let mut late = at_check(5.0, 0.0);
    late.opened = Some(Merit::Violated(1.0));
    assert_eq!(stops(late), None);
    let mut never = at_check(0.0, 0.0);
    never.marks[0].merit = Merit::Failed;
    assert!(stops(never).is_some());
}

#[test]
fn the_median_rule_wants_four_to_compare_with() {
    let at_check = |merit: f64| RaceRecord {
        marks: vec![mark(Gate::Check(1), Merit::Feasible(merit), 0.0)],
        ..RaceRecord::default()
    };
    let records: Vec<_> = [1.0, 9.0, 3.0, 4.0, 3.5, 2.0].map(at_check).to_vec();
    let decisions = due(&checked(DominationRule::Median), &records, &near);
    let stopped: Vec<_> = decisions.iter().map(|(_, d)| d.stop.is_some()).collect();
    assert_eq!(stopped, [false, false, false, false, true, false]);
}

#[test]
fn restarts_that_head_for_one_optimum_merge() {
    let options = Competition {
        merge_within: Some(0.1),
        ..Competition::default()
    };
    let at = |x: f64, orientation| RaceRecord {
        orientation,
        marks: vec![mark(Gate::Check(1), Merit::Feasible(0.0), x)],
        ..RaceRecord::default()
    };
    let clockwise = Some(Orientation::Clockwise);
    let ended = RaceRecord {
        orientation: clockwise,
        end: Some(End {
            x: vec![5.0],
            merit: Merit::Feasible(0.0),
        }),
        out: true,
        ..RaceRecord::default()
    };
    let records = [
        at(1.0, clockwise),
        at(1.02, Some(Orientation::CounterClockwise)),
        at(1.05, clockwise),
        at(1.12, clockwise),
        ended,
        at(5.02, clockwise),
    ];
    let decisions = due(&options, &records, &near);
    let with: Vec<_> = decisions
        .iter()
        .map(|(_, d)| match d.stop {
            Some(StudyStop::Merged { with, .. }) => Some(with),
            _ => None,
        })
        .collect();
    // The fourth is near to the third only, which has merged itself; the fifth ended by itself.
    assert_eq!(with, [None, None, Some(0), None, Some(4)]);
}

#[test]
fn feasible_comes_before_violated_before_failed() {
    let order = [
        Merit::of(-1e9, 0.0, 0.003),
        Merit::of(7.0, 0.003, 0.003),
        Merit::of(-1e9, 0.01, 0.003),
        Merit::of(-1e9, 0.5, 0.003),
        Merit::Failed,
    ];
    for pair in order.windows(2) {
        assert!(pair[0].better_than(&pair[1]) && !pair[1].better_than(&pair[0]));
    }
}

#[test]
fn the_rank_correlation_is_spearmans() {
    let f = Merit::Feasible;
    // Ties share ranks: 1, 2.5, 2.5, 4 against 1, 3, 2, 4 (worked by hand: 4.5 / sqrt(4.5 * 5)).
    let pairs = [
        (f(1.0), f(10.0)),
        (f(2.0), f(30.0)),
        (f(2.0), f(20.0)),
        (Merit::Violated(0.1), Merit::Failed),
    ];
    let rho = spearman(&pairs).expect("they differ");
    assert!((rho - 4.5 / 22.5_f64.sqrt()).abs() < 1e-12, "{rho}");
    assert_eq!(spearman(&[(f(1.0), f(1.0)), (f(1.0), f(2.0))]), None);
}

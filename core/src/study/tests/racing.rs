//! Restarts that compete, with a cheap stand-in for the model, told in any order.

use super::*;
use crate::random::SplitMix64;
use crate::study::race::{Gate, Merit, RaceRecord, due};
use crate::study::restart::{StudyStop, pass, resume};

/// Many valleys in the bounds of a program: f = sum of (x - 3)^2 + 8 sin(3 x), shifted at a lower fidelity.
fn answer(request: &EvaluationRequest) -> Outcome {
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    let shift = request.fidelity.map_or(0.0, |f| 0.1 * f.mesh);
    let value = |v: &f64| (v - 3.0).powi(2) + 8.0 * (3.0 * v + shift).sin();
    let slope = |v: &f64| 2.0 * (v - 3.0) + 24.0 * (3.0 * v + shift).cos();
    outcome.objective = Some(request.x.iter().map(value).sum());
    if request.want_gradient {
        outcome.gradient = Some(request.x.iter().map(slope).collect());
        outcome.constraint_gradients = Some(Vec::new());
    }
    outcome
}

fn valleys(restarts: &str) -> Value {
    crate::document::parse_toml(&format!(
        r#"
name = "valleys"
[[step]]
id = "solve"
model = {{ kind = "command", argv = ["x"], time_limit_s = 1, gradient = true }}
variables = {{ lower = [0, 0], upper = [10, 10] }}
optimiser = {{ method = "gcmma" }}
restarts = {{ start = "random", count = 20, {restarts} }}
"#
    ))
    .expect("TOML")
}

const ALL: &str = r"race = { rungs = [{ evaluations = 4 }, { evaluations = 6 }], eta = 2 }, stop_dominated = { every = 6 }, merge_within = 0.02";

/// Runs all restarts of a step, the batches answered in an order drawn from `order`; the race is looked at whenever one of
/// them moved, or only now and then.
fn run(
    study: &Study,
    order: u64,
    answer: impl Fn(&EvaluationRequest) -> Outcome,
) -> Vec<RestartState> {
    let mut stream = SplitMix64::new(order);
    let specs = study.restarts(0, &StepInputs::default()).expect("restarts");
    let begun = specs
        .iter()
        .map(|spec| begin(study, spec).expect("begins").0);
    let mut states: Vec<RestartState> = begun.collect();
    for _ in 0..100_000 {
        let busy: Vec<usize> = (0..states.len())
            .filter(|i| !states[*i].pending.is_empty())
            .collect();
        if let Some(place) = (stream.next_u64() as usize).checked_rem(busy.len()) {
            let state = &mut states[busy[place]];
            let outcomes: Vec<_> = state.pending.iter().map(&answer).collect();
            let text = serde_json::to_string(&*state).expect("serialises");
            let stored = serde_json::from_str(&text).expect("reads back");
            *state = step(study, &stored, &outcomes).expect("goes on").state;
        }
        if busy.is_empty() || stream.next_u64().is_multiple_of(3) {
            let decided = decide(study, &mut states);
            if busy.is_empty() && !decided {
                assert!(states.iter().all(|state| state.stop.is_some()));
                return states;
            }
        }
    }
    panic!("the race does not end");
}

fn decide(study: &Study, states: &mut [RestartState]) -> bool {
    let records: Vec<RaceRecord> = states
        .iter()
        .filter_map(|state| state.race_record().cloned())
        .collect();
    let distance = |a: &[f64], b: &[f64]| study.scaled_distance(0, a, b).expect("a step");
    let competition = &study.steps[0].restarts.competition;
    let decisions = due(competition, &records, &distance);
    for (index, decision) in &decisions {
        states[*index] = pass(study, &states[*index], decision)
            .expect("a step")
            .state;
    }
    !decisions.is_empty()
}

fn reasons(states: &[RestartState]) -> Vec<String> {
    let reason = |state: &RestartState| state.stop.expect("a reason").name();
    states.iter().map(reason).collect()
}

#[test]
fn the_order_of_arrival_changes_nothing() {
    let study = study(&valleys(ALL));
    let first = run(&study, 1, answer);
    for order in 2..12 {
        assert_eq!(run(&study, order, answer), first, "order {order}");
    }
    let reasons = reasons(&first);
    for reason in ["not_promoted", "merged"] {
        assert!(reasons.iter().any(|r| r == reason), "{reason}: {reasons:?}");
    }
    // More starts keep what became of the first ones.
    let mut document = valleys(ALL);
    document["step"][0]["restarts"]["count"] = serde_json::json!(26);
    let more = run(&super::study(&document), 5, answer);
    let histories = |states: &[RestartState]| -> Vec<String> {
        states.iter().map(|s| s.history_sha256.clone()).collect()
    };
    assert_eq!(histories(&more)[..20], histories(&first));
}

#[test]
fn racing_costs_less_and_finds_as_much() {
    let alone = run(&study(&valleys("")), 1, answer);
    let race = r"race = { rungs = [{ evaluations = 4 }] }";
    let racing = run(&study(&valleys(race)), 1, answer);
    let cost = |states: &[RestartState]| states.iter().map(|s| s.evaluations).sum::<usize>();
    assert!(cost(&racing) < cost(&alone));
    let best = |states: &[RestartState]| {
        let bests = states.iter().filter_map(|s| s.best.as_ref());
        bests.map(|b| b.objective).fold(f64::INFINITY, f64::min)
    };
    assert!((best(&racing) - best(&alone)).abs() < 1e-3 * best(&alone).abs());
}

#[test]
fn dominated_restarts_are_stopped_with_their_numbers_and_can_be_resumed() {
    let study = study(&valleys(r"stop_dominated = { every = 3, ahead = 0.5 }"));
    let states = run(&study, 1, answer);
    let (index, stopped) = states
        .iter()
        .enumerate()
        .find(|(_, s)| {
            matches!(
                s.stop,
                Some(RestartStop::Study(StudyStop::Dominated { .. }))
            )
        })
        .expect("one is dominated");
    let Some(RestartStop::Study(StudyStop::Dominated {
        reference,
        bound,
        of,
        evaluations,
        ..
    })) = stopped.stop
    else {
        panic!("{:?}", stopped.stop)
    };
    assert!(reference.better_than(&bound) && of >= 1 && of <= index);
    assert_eq!(evaluations, stopped.evaluations);
    let before = stopped.race_record().cloned().expect("it competes");
    let mut next = resume(&study, stopped)
        .expect("a step")
        .expect("stopped by the race");
    assert!(next.done.is_none() && !next.asks.is_empty());
    while next.done.is_none() {
        let outcomes: Vec<_> = next.asks.iter().map(answer).collect();
        next = step(&study, &next.state, &outcomes).expect("goes on");
    }
    // It went to its own end, and what it showed to the others is as it was.
    assert!(matches!(next.done, Some(RestartStop::Optimiser(_))));
    let after = next.state.race_record().expect("it competes");
    assert!(after.resumed && !before.resumed);
    assert_eq!((&after.marks, &after.end), (&before.marks, &before.end));
    let again = resume(&study, &next.state).expect("a step");
    assert!(again.is_none(), "it ended by itself");
}

/// Finite elements whose answer is that of the valleys over two of the corners.
fn chambers(race: &str) -> Study {
    let race = format!("step[0].restarts.race={race}");
    study(&with(
        &example("asymmetric-bending"),
        &[
            "step[0].constraints={\"stretch\": \"off\", \"load_margin\": \"off\"}",
            "step[0].restarts={\"start\": \"random\", \"count\": 6, \"race\": true}",
            "step[0].optimiser.max_iterations=8",
            &race,
        ],
    ))
}

fn smooth(study: &Study, request: &EvaluationRequest, agrees: bool) -> Outcome {
    let (values, rows) = study.geometry_rows(0, &request.x).expect("rows");
    let sign = if agrees || request.fidelity.is_none() {
        1.0
    } else {
        -1.0
    };
    let mut outcome = Outcome::without_values(OutcomeStatus::Ok);
    outcome.objective = Some(sign * request.x.iter().map(|v| (v - 30.0).powi(2)).sum::<f64>());
    outcome.constraints = values;
    if request.want_gradient {
        let slopes = request.x.iter().map(|v| sign * 2.0 * (v - 30.0));
        outcome.gradient = Some(slopes.collect());
        outcome.constraint_gradients = Some(rows);
    }
    outcome
}

#[test]
fn coarse_designs_go_up_and_never_count() {
    let study =
        chambers(r#"{"rungs": [{"evaluations": 3, "mesh": "coarse", "load_steps_per_leg": 4}]}"#);
    let seen = std::cell::RefCell::new(Vec::new());
    let states = run(&study, 3, |request| {
        seen.borrow_mut().push(request.clone());
        smooth(&study, request, true)
    });
    let seen = seen.into_inner();
    let coarse: Vec<_> = seen.iter().filter(|r| r.fidelity.is_some()).collect();
    assert!(
        coarse
            .iter()
            .all(|r| r.fidelity.expect("coarse").mesh == 0.5)
    );
    assert!(coarse.len() >= 3 * states.len() && coarse.len() < seen.len());
    for state in &states {
        let record = state.race_record().expect("it competes");
        let mark = record.at(Gate::Rung(0)).expect("a rung");
        let went_up = mark.decision.as_ref().expect("decided").stop.is_none();
        assert_eq!(went_up, mark.next.is_some());
        assert_eq!(went_up, record.rung == 1);
        if went_up {
            // The same design, whose mesh plan is its own now, was evaluated first at the study's fidelity.
            let first = seen.iter().find(|r| r.fidelity.is_none() && r.x == mark.x);
            assert_eq!(first.expect("it went up").plan_base.as_ref(), Some(&mark.x));
            assert_eq!(mark.next, Some(mark.merit));
        } else {
            assert_eq!(state.best, None, "a coarse design counts");
        }
    }
    // Fidelity is part of what is asked.
    let request = coarse[0];
    let full = EvaluationRequest {
        fidelity: None,
        ..request.clone()
    };
    assert_ne!(request.key(&study, ""), full.key(&study, ""));
    assert_eq!(study.band(request), None);
    assert!(study.band(&full).is_some());
}

#[test]
fn fidelities_that_disagree_switch_the_race_off() {
    let mut study = chambers(r#"{"rungs": [{"evaluations": 1, "mesh": 0.3}], "eta": 2}"#);
    study.steps[0].restarts.count = 14;
    let states = run(&study, 7, |request| smooth(&study, request, false));
    let off: Vec<_> = states
        .iter()
        .map(|state| {
            let mark = &state.race_record().expect("it competes").marks[0];
            mark.decision.as_ref().expect("decided").race_off
        })
        .collect();
    assert!(!off[7] && off[16..].iter().all(|off| *off), "{off:?}");
    let record = states[27].race_record().expect("it competes");
    let decision = record.marks[0].decision.as_ref().expect("decided");
    assert!(
        decision
            .correlation
            .expect("known")
            .spearman
            .expect("differ")
            < 0.0
    );
    assert!(decision.stop.is_none() && record.rung == 1);
}

#[test]
fn a_start_that_fails_on_a_rung_comes_last() {
    let study = chambers(r#"{"rungs": [{"evaluations": 2, "mesh": "coarse"}]}"#);
    let states = run(&study, 3, |request| {
        // Every start of the second pair fails at the low fidelity alone.
        let fails = request.fidelity.is_some() && request.x[0] < 25.0;
        if fails {
            Outcome::without_values(OutcomeStatus::WorkLimit)
        } else {
            smooth(&study, request, true)
        }
    });
    let merits = states
        .iter()
        .map(|s| s.race_record().expect("it competes").marks[0].merit);
    for (merit, state) in merits.zip(&states) {
        let stopped = matches!(
            state.stop,
            Some(RestartStop::Study(StudyStop::NotPromoted { .. }))
        );
        assert!(merit != Merit::Failed || stopped || state.spec.index == 0);
    }
}

#[test]
fn faults_have_their_paths() {
    let fault = |restarts: &str, path: &str| {
        let document = with(
            &example("asymmetric-bending"),
            &[&format!("step[0].restarts={restarts}")],
        );
        let found = faults(&document);
        assert!(
            found.contains(&format!("step[0].restarts.{path}")),
            "{path}: {found:?}"
        );
    };
    let of = |rest: &str| format!(r#"{{"start": "random", "count": 2, {rest}}}"#);
    for (rest, path) in [
        (r#""race": "on""#, "race"),
        (r#""race": {"eta": 0}"#, "race.eta"),
        (r#""race": {"rungs": []}"#, "race.rungs"),
        (r#""race": {"rungs": [{}]}"#, "race.rungs[0].evaluations"),
        (
            r#""race": {"rungs": [{"evaluations": 4, "mesh": "fine"}]}"#,
            "race.rungs[0].mesh",
        ),
        (
            r#""race": {"rungs": [{"evaluations": 4, "mesh": 2}]}"#,
            "race.rungs[0].mesh",
        ),
        (
            r#""race": {"rungs": [{"evaluations": 4}, {"evaluations": 4, "mesh": 0.5}]}"#,
            "race.rungs",
        ),
        (
            r#""race": {"least_correlation": 2}"#,
            "race.least_correlation",
        ),
        (r#""stop_dominated": 3"#, "stop_dominated"),
        (
            r#""stop_dominated": {"rule": "luck"}"#,
            "stop_dominated.rule",
        ),
        (
            r#""stop_dominated": {"rule": "median", "ahead": 2}"#,
            "stop_dominated.ahead",
        ),
        (r#""merge_within": 0"#, "merge_within"),
        (r#""merge_within": 1.5"#, "merge_within"),
    ] {
        fault(&of(rest), path);
    }
    let search = with(
        &example("asymmetric-bending"),
        &[
            r#"step[0].optimiser={"method": "random_search", "evaluations": 9}"#,
            "step[0].restarts.race=true",
        ],
    );
    assert_eq!(faults(&search), ["step[0].restarts.race"]);
    let program = faults(&valleys(
        r"race = { rungs = [{ evaluations = 4, mesh = 0.5 }] }",
    ));
    assert_eq!(program, ["step[0].restarts.race.rungs[0].mesh"]);
}

#[test]
fn defaults_read_back() {
    for restarts in [
        "race = true, stop_dominated = true, merge_within = true",
        "race = false, stop_dominated = false, merge_within = false",
        r#"race = {}, stop_dominated = { rule = "median" }"#,
        ALL,
    ] {
        let study = study(&valleys(restarts));
        assert_eq!(read_study(&study.document(), true).as_ref(), Ok(&study));
        let own = study.steps[0].restarts.competition.clone();
        assert_eq!(own.is_none(), restarts.contains("false"));
        assert_eq!(own.fidelity(0), None, "a program has one");
    }
    // At a state within a leg there is no path with fewer of them.
    let within = |state: usize, race: &str| {
        with(
            &example("asymmetric-bending"),
            &[
                &format!(
                    r#"step[0].target={{"kind": "displacement", "probe_mm": [160, 40], "component": "y", "state": {state}}}"#
                ),
                &format!(r#"step[0].restarts={{"start": "paper", "race": {race}}}"#),
            ],
        )
    };
    let steps = |document: &Value| {
        let fidelity = self::study(document).steps[0]
            .restarts
            .competition
            .fidelity(0);
        fidelity.expect("a coarser mesh").load_steps_per_leg
    };
    assert_eq!(steps(&within(16, "true")), Some(4));
    assert_eq!(steps(&within(13, "true")), None);
    let named = r#"{"rungs": [{"evaluations": 8, "load_steps_per_leg": 4}]}"#;
    assert!(faults(&within(16, named)).is_empty());
    let path = "step[0].restarts.race.rungs[0].load_steps_per_leg";
    assert_eq!(faults(&within(13, named)), [path]);
    let fewer = self::study(&within(16, named));
    let fewer = fewer.with_load_steps(0, 4);
    let target = fewer.steps[0].target.as_ref().expect("a target");
    assert!(matches!(
        target.goal.measure,
        crate::scene::measure::Measure::Displacement { state: 8, .. }
    ));
    let study = chambers("true");
    assert_eq!(read_study(&study.document(), false).as_ref(), Ok(&study));
    let fidelity = study.steps[0].restarts.competition.fidelity(0);
    let fidelity = fidelity.expect("a coarser mesh");
    assert_eq!((fidelity.mesh, fidelity.load_steps_per_leg), (0.5, Some(4)));
}

//! Checks the steps of a study as a whole: who takes from whom, what each model can represent.

use std::collections::BTreeSet;

use crate::document::Object;
use crate::geometry::ChamberCorners;
use crate::optimiser::OptimiserOptions;
use crate::study::sequence::most_letters;
use crate::study::spec::{Model, Parametrisation, StartKind, StudyBody, StudyStep, Variables};
use crate::study::takes::{Pass, Simplification, Take, TakenAs};

/// Notes every fault of the graph, and fills in how many candidates are taken where the document does not say it.
pub fn check_graph(
    root: &Object<'_>,
    body: Option<&StudyBody>,
    steps: &mut [StudyStep],
) -> Option<()> {
    let mut graph = Graph {
        root,
        body,
        sound: true,
    };
    for i in 0..steps.len() {
        graph.sources(steps, i);
        graph.designs(steps, i);
        graph.simplifications(steps, i);
    }
    graph.circles(steps);
    graph.sound.then_some(())
}

struct Graph<'a> {
    root: &'a Object<'a>,
    body: Option<&'a StudyBody>,
    sound: bool,
}

impl Graph<'_> {
    fn fault(&mut self, path: &str, message: String) {
        self.root.fault(path, message);
        self.sound = false;
    }

    /// The steps that a step takes from are there, and have what it takes.
    fn sources(&mut self, steps: &mut [StudyStep], i: usize) {
        for k in 0..steps[i].takes.len() {
            let path = format!("step[{i}].takes[{k}]");
            let take = &steps[i].takes[k];
            let Some(source) = steps.iter().position(|s| s.id == take.step) else {
                let ids: Vec<&str> = steps.iter().map(|s| s.id.as_str()).collect();
                let message = format!(
                    "no step is named \"{}\"; there are {}",
                    take.step,
                    ids.join(", ")
                );
                self.fault(&format!("{path}.step"), message);
                continue;
            };
            if source == i {
                self.fault(
                    &format!("{path}.step"),
                    "a step cannot take from itself".into(),
                );
                continue;
            }
            let (step, other) = (&steps[i], &steps[source]);
            let backwards = step.pass == Pass::Forward
                && (other.pass == Pass::Backward || other.level > step.level);
            let downwards = step.pass == Pass::Backward
                && other.pass == Pass::Backward
                && other.level < step.level;
            if backwards || downwards {
                let message = format!(
                    "step \"{}\" is on level {} of the {} pass; {}",
                    other.id,
                    other.level,
                    word(other.pass),
                    if backwards {
                        "a step of the forward pass takes from levels above it, of the same pass"
                    } else {
                        "the backward pass goes from the last level up"
                    }
                );
                self.fault(&format!("{path}.step"), message);
            }
            let complaint = has_not(take.taken_as, step, other)
                .or_else(|| self.corners_lost(take.taken_as, step, other));
            if let Some(complaint) = complaint {
                self.fault(&format!("{path}.as"), complaint);
            }
            if take.candidates > other.keeps {
                let message = format!(
                    "step \"{}\" keeps {} (keeps), so {} cannot be taken",
                    other.id, other.keeps, take.candidates
                );
                self.fault(&format!("{path}.candidates"), message);
            }
            let keeps = other.keeps;
            let candidates = &mut steps[i].takes[k].candidates;
            if *candidates == 0 {
                *candidates = keeps;
            }
        }
    }

    /// Quadrilaterals are hexagons too, but not the other way round.
    fn corners_lost(&self, taken: TakenAs, step: &StudyStep, other: &StudyStep) -> Option<String> {
        let of_body = self.body?.actuator.corners;
        let corners = |s: &StudyStep| s.variables.corners().unwrap_or(of_body);
        let chambers = matches!(
            taken,
            TakenAs::Starts | TakenAs::Geometry | TakenAs::Alphabet
        );
        let lost =
            chambers && corners(other) == ChamberCorners::Six && corners(step) != corners(other);
        lost.then(|| {
            format!(
                "chambers of step \"{}\" have six corners, those of this one four",
                other.id
            )
        })
    }

    /// Designs are taken exactly where the optimiser wants them, and every free unit gets one.
    fn designs(&mut self, steps: &[StudyStep], i: usize) {
        let step = &steps[i];
        if step.variables.are_letters() {
            self.letters(steps, i);
            return;
        }
        let sweeps = matches!(&step.optimiser, OptimiserOptions::Sweep(_));
        let wanted = match &step.optimiser {
            OptimiserOptions::Sweep(options) => options.points.is_empty(),
            _ => step.restarts.start.contains(&StartKind::Taken),
        };
        let (kind, field, other) = if sweeps {
            (TakenAs::Geometry, "optimiser.points", "starts")
        } else {
            (TakenAs::Starts, "restarts.start", "geometry")
        };
        let designs: Vec<_> = step.takes.iter().filter(|t| t.taken_as == kind).collect();
        if let Some(k) = step.takes.iter().position(|t| {
            matches!(t.taken_as, TakenAs::Starts | TakenAs::Geometry) && t.taken_as != kind
        }) {
            let message = if sweeps {
                format!("a sweep has no starts: take \"geometry\", not \"{other}\"")
            } else {
                format!("an optimiser begins from \"starts\", not from \"{other}\"")
            };
            self.fault(&format!("step[{i}].takes[{k}].as"), message);
            return;
        }
        if wanted && designs.is_empty() {
            let name = if sweeps { "geometry" } else { "starts" };
            self.fault(
                &format!("step[{i}].{field}"),
                format!("\"taken\" needs an entry of takes as \"{name}\""),
            );
        }
        if !wanted && !designs.is_empty() {
            self.fault(
                &format!("step[{i}].{field}"),
                "must be (or contain) \"taken\", since takes gives it designs".into(),
            );
        }
        let direct = matches!(step.model, Model::FeDirect(_));
        let units = self.units(step);
        let mut covered = BTreeSet::new();
        for take in &designs {
            for unit in &take.units {
                if *unit > units || !direct {
                    let message = if direct {
                        format!("unit {unit} of {units}")
                    } else {
                        "all units are copies of one here: only \"fe_direct\" has units of their own".into()
                    };
                    self.fault(&format!("step[{i}].takes"), message);
                }
                if !covered.insert(*unit) {
                    self.fault(
                        &format!("step[{i}].takes"),
                        format!("unit {unit} is taken from two steps"),
                    );
                }
            }
            if take.units.is_empty() && designs.len() > 1 {
                self.fault(
                    &format!("step[{i}].takes"),
                    "several steps give chambers: each must say which units it gives".into(),
                );
            }
        }
        if !covered.is_empty() && covered.len() < units && direct {
            let missing: Vec<String> = (1..=units)
                .filter(|unit| !covered.contains(unit))
                .map(|unit| unit.to_string())
                .collect();
            self.fault(
                &format!("step[{i}].takes"),
                format!(
                    "the units do not tile the actuator: nothing gives unit {}",
                    missing.join(", ")
                ),
            );
        }
    }

    /// The units of sequences are there, and enough of them.
    fn letters(&mut self, steps: &[StudyStep], i: usize) {
        let step = &steps[i];
        let of_designs = |t: &Take| matches!(t.taken_as, TakenAs::Starts | TakenAs::Geometry);
        if let Some(k) = step.takes.iter().position(of_designs) {
            self.fault(
                &format!("step[{i}].takes[{k}].as"),
                "a sequence is made of units of other steps: take them as \"alphabet\"".into(),
            );
            return;
        }
        let whole = self.body.map_or(1, |body| body.actuator.units);
        let offered = most_letters(steps, step, whole);
        if offered < 2 {
            self.fault(
                &format!("step[{i}].takes"),
                format!(
                    "a sequence needs two units at least, taken as \"alphabet\" (keeps of their steps, candidates); found {offered}"
                ),
            );
        }
        for (k, take) in step.takes.iter().enumerate() {
            let Some(source) = steps.iter().find(|s| s.id == take.step) else {
                continue;
            };
            let free = if source.model.is_direct() {
                self.units(source)
            } else {
                1
            };
            let of_alphabet = take.taken_as == TakenAs::Alphabet;
            if let Some(unit) = take.units.iter().find(|u| of_alphabet && **u > free) {
                let message = format!("step \"{}\" designs {free}, not unit {unit}", take.step);
                self.fault(&format!("step[{i}].takes[{k}].units"), message);
            }
        }
    }

    fn units(&self, step: &StudyStep) -> usize {
        let whole = self.body.map_or(1, |body| body.actuator.units);
        step.model.units().unwrap_or(whole)
    }

    /// A step's model can stand for what it says to simplify.
    fn simplifications(&mut self, steps: &[StudyStep], i: usize) {
        let step = &steps[i];
        let whole = self.body.map_or(1, |body| body.actuator.units);
        let fewer = self.units(step) < whole;
        let reduced = step.model.reduced().is_some();
        for (k, simplification) in step.simplifies.iter().enumerate() {
            let complaint = match simplification {
                Simplification::Repeat => matches!(step.model, Model::FeDirect(_)).then(|| {
                    "\"fe_direct\" has units of their own, so it repeats none".to_owned()
                }),
                Simplification::Reduce => (!fewer && !reduced).then(|| {
                    format!("the model has all {whole} units and is no reduced one, so it reduces nothing")
                }),
                Simplification::Split => (!fewer).then(|| {
                    format!("the model has all {whole} units, so it is no part of the actuator")
                }),
                Simplification::Symmetry => {
                    let symmetric = matches!(
                        step.variables,
                        Variables::Chambers {
                            parametrisation: Parametrisation::Rectangle,
                            ..
                        }
                    );
                    (!symmetric).then(|| {
                        "the variables are not symmetric: \"rectangle\" is the parametrisation that is".to_owned()
                    })
                }
            };
            if let Some(complaint) = complaint {
                self.fault(&format!("step[{i}].simplifies[{k}]"), complaint);
            }
        }
    }

    /// No step waits for itself.
    fn circles(&mut self, steps: &[StudyStep]) {
        let sources = |i: usize| {
            let takes = steps[i].takes.iter();
            takes.filter_map(|take| steps.iter().position(|s| s.id == take.step))
        };
        let mut settled = vec![false; steps.len()];
        loop {
            let free = (0..steps.len()).find(|i| !settled[*i] && sources(*i).all(|s| settled[s]));
            match free {
                Some(i) => settled[i] = true,
                None => break,
            }
        }
        let caught: Vec<usize> = (0..steps.len()).filter(|i| !settled[*i]).collect();
        // Of the caught ones, those that others of them wait for: the circle, without what merely follows it.
        let mut circle = caught.clone();
        while let Some(k) = circle
            .iter()
            .position(|i| !circle.iter().any(|other| sources(*other).any(|s| s == *i)))
        {
            circle.remove(k);
        }
        if let Some(first) = circle.first() {
            let ids: Vec<&str> = circle.iter().map(|i| steps[*i].id.as_str()).collect();
            let message = format!("these steps wait for each other: {}", ids.join(", "));
            self.fault(&format!("step[{first}].takes"), message);
        }
    }
}

fn word(pass: Pass) -> &'static str {
    match pass {
        Pass::Forward => "forward",
        Pass::Backward => "backward",
    }
}

/// Why a step cannot give another one what it wants.
fn has_not(taken_as: TakenAs, step: &StudyStep, other: &StudyStep) -> Option<String> {
    let chambers = |model: &Model| {
        matches!(
            model,
            Model::FeCascade(_) | Model::FeDirect(_) | Model::FeLayouts(_)
        )
    };
    match taken_as {
        TakenAs::Layout if !chambers(&step.model) || matches!(step.model, Model::FeLayouts(_)) => {
            Some("only a chain of units takes a layout".into())
        }
        TakenAs::Alphabet if !step.variables.are_letters() => Some(
            "only sequences have an alphabet: variables = { parametrisation = \"sequence\" }"
                .into(),
        ),
        TakenAs::Layout | TakenAs::Alphabet if !chambers(&other.model) => {
            Some(format!("step \"{}\" has no chambers", other.id))
        }
        TakenAs::Behaviour if !matches!(step.model, Model::FeLayouts(_)) => {
            Some("only \"fe_layouts\" is held against transformations that are asked for".into())
        }
        TakenAs::Behaviour if other.model.reduced().is_none() => Some(format!(
            "step \"{}\" asks for no transformations: its model is none of \"linear_transform\" and \"constant_strain\"",
            other.id
        )),
        TakenAs::Layout | TakenAs::Behaviour | TakenAs::Alphabet => None,
        TakenAs::Starts | TakenAs::Geometry => match (&other.model, &step.model) {
            (Model::FeDirect(_), Model::FeCascade(_)) => Some(format!(
                "the units of step \"{}\" differ from each other, and here all are copies of one",
                other.id
            )),
            (Model::FeDirect(a), Model::FeDirect(b)) if a.units != b.units => {
                Some(format!("step \"{}\" has another number of units", other.id))
            }
            (_, Model::FeLayouts(_)) => Some("\"fe_layouts\" sweeps its own points".into()),
            (from, to) if chambers(from) && chambers(to) => {
                let rectangle = matches!(
                    step.variables,
                    Variables::Chambers {
                        parametrisation: Parametrisation::Rectangle,
                        ..
                    }
                );
                rectangle.then(|| {
                    "the variables are the sides of rectangles, which corners are not".to_owned()
                })
            }
            (Model::LinearTransform(a), Model::LinearTransform(b))
            | (Model::ConstantStrain(a), Model::ConstantStrain(b))
                if a.actuations == b.actuations =>
            {
                None
            }
            (Model::Command(_), Model::Command(_)) => None,
            _ => Some(format!(
                "the variables of step \"{}\" are not those of this one",
                other.id
            )),
        },
    }
}

//! Whether a chain of few units is fit to stand for nine: what was measured for each named schedule.
//!
//! A study may optimise the area that the tip of three units encloses and build nine. That serves where the two areas have the same
//! sign and rank designs alike. `benches/surrogate` compares them over random designs and designs met by optimisers
//! (`docs/data/surrogate.csv`, `docs/surrogate.md`): 15 kPa, `mold-star-30`, contact; the tip of few units is the middle of the right
//! edge of the last but one, that of nine is the one of unit 8 or 9, the worse counts. Signs are compared where both areas are
//! larger than their error.

use serde::Serialize;

use crate::actuation::ActuationCycle;

/// Units of the whole actuator.
pub const WHOLE: usize = 9;
/// Area of few units above which one counts as large, mm^2: what optimisers look for.
pub const LARGE_MM2: f64 = 10.0;
/// Share of designs whose sign must agree.
pub const LEAST_AGREEMENT: f64 = 0.95;
/// The share of the square of the tip's largest displacement by which a mesh of the measurement may be wrong in an area.
#[cfg(test)]
const MESH_ERROR: f64 = 3e-3;

/// What was measured of a schedule and a number of units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Name of the schedule.
    pub schedule: &'static str,
    /// Units in the chain.
    pub units: usize,
    /// Share of the compared designs whose area has the sign of that of nine units.
    pub sign: f64,
    /// Designs whose signs were compared.
    pub compared: usize,
    /// The same share of those whose area on few units is larger than [`LARGE_MM2`].
    pub sign_of_large: f64,
    /// Spearman's rank correlation of the signed areas.
    pub spearman: f64,
}

/// From `docs/data/surrogate.csv`, by `benches/surrogate/report.py`; of both tips of nine units the lesser values.
pub const MEASURED: [Agreement; 6] = [
    measured("hold", 3, 0.8647, 170, 0.9836, 0.854),
    measured("swap", 3, 0.8333, 180, 0.9683, 0.814),
    measured("overlap", 3, 0.8974, 195, 0.9905, 0.891),
    measured("hold", 5, 0.9360, 172, 0.9900, 0.928),
    measured("swap", 5, 0.9505, 182, 1.0000, 0.950),
    measured("overlap", 5, 0.9497, 199, 0.9926, 0.948),
];

const fn measured(
    schedule: &'static str,
    units: usize,
    sign: f64,
    compared: usize,
    sign_of_large: f64,
    spearman: f64,
) -> Agreement {
    Agreement {
        schedule,
        units,
        sign,
        compared,
        sign_of_large,
        spearman,
    }
}

/// Whether the area of few units may stand for that of nine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum Fitness {
    /// The signs agree often enough.
    Fit(Agreement),
    /// They do not.
    Unfit(Agreement),
    /// Nine units or more stand for themselves.
    Whole,
    /// Not measured for this schedule or this number of units.
    NotMeasured {
        /// Units in the chain.
        units: usize,
    },
}

impl Agreement {
    /// Whether its signs agree often enough.
    pub fn is_fit(&self) -> bool {
        self.sign >= LEAST_AGREEMENT
    }
}

/// Whether a chain of `units` is fit for a schedule. Channels may be exchanged and the cycle may be run backwards: a mirrored
/// design, or the other sense, has the same areas.
pub fn fitness(rows_kpa: &[Vec<f64>], units: usize) -> Fitness {
    if units >= WHOLE {
        return Fitness::Whole;
    }
    let found = name_of(rows_kpa).and_then(|name| {
        let is = |m: &&Agreement| m.schedule == name && m.units == units;
        MEASURED.iter().find(is)
    });
    match found {
        Some(measured) if measured.is_fit() => Fitness::Fit(*measured),
        Some(measured) => Fitness::Unfit(*measured),
        None => Fitness::NotMeasured { units },
    }
}

/// The fewest units that are fit for a schedule, of `whole` at most; all of them where none are, or where nothing was measured.
pub fn fewest_fit(rows_kpa: &[Vec<f64>], whole: usize) -> usize {
    let fit = |units: &usize| matches!(fitness(rows_kpa, *units), Fitness::Fit(_));
    let few = MEASURED.iter().map(|m| m.units).filter(|n| *n < whole);
    few.filter(fit).min().unwrap_or(whole)
}

/// The measured schedule that rows follow, in either order of the channels and in either direction.
fn name_of(rows_kpa: &[Vec<f64>]) -> Option<&'static str> {
    let largest = rows_kpa.iter().flatten().fold(0.0, |m: f64, p| m.max(*p));
    let exchanged = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let turned = rows.iter().map(|row| row.iter().rev().copied().collect());
        turned.collect()
    };
    let backwards = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> { rows.iter().rev().cloned().collect() };
    let mut names = MEASURED.iter().map(|m| m.schedule);
    names.find(|name| {
        ActuationCycle::named_rows(name, largest).is_some_and(|rows| {
            let turned = exchanged(&rows);
            rows == rows_kpa
                || turned == rows_kpa
                || backwards(&rows) == rows_kpa
                || backwards(&turned) == rows_kpa
        })
    })
}

impl Fitness {
    /// What a report says; `None` where there is nothing to say.
    pub fn sentence(&self) -> Option<String> {
        let share = |m: &Agreement| format!("{:.0} % of {} designs", 100.0 * m.sign, m.compared);
        match self {
            Self::Whole => None,
            Self::Fit(m) => Some(format!(
                "the area of {} units is fit for `{}`: its sign is that of {WHOLE} units for {}",
                m.units,
                m.schedule,
                share(m)
            )),
            Self::Unfit(m) => {
                let fit = |o: &&Agreement| o.schedule == m.schedule && o.is_fit();
                let instead = MEASURED.iter().filter(fit).map(|o| o.units).min();
                Some(format!(
                    "the area of {} units is unfit for `{}`: its sign is that of {WHOLE} units for only {} ({:.0} % are asked \
                     for; {:.0} % of areas above {LARGE_MM2} mm^2); fit from {} units on",
                    m.units,
                    m.schedule,
                    share(m),
                    100.0 * LEAST_AGREEMENT,
                    100.0 * m.sign_of_large,
                    instead.unwrap_or(WHOLE)
                ))
            }
            Self::NotMeasured { units } => Some(format!(
                "whether the area of {units} units may stand for that of {WHOLE} was not measured for this schedule"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Cells by column.
    type Line = BTreeMap<String, String>;
    /// Lines by design and number of units.
    type Data = BTreeMap<usize, BTreeMap<usize, Line>>;

    /// The lines of the data.
    fn data() -> Data {
        let text = include_str!("../../../docs/data/surrogate.csv");
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
        let mut all = Data::new();
        for line in lines {
            let cells = line.split(',').map(str::to_owned);
            let line: Line = names.iter().map(|n| (*n).to_owned()).zip(cells).collect();
            let index = |name: &str| line[name].parse::<usize>().expect("a count");
            all.entry(index("design"))
                .or_default()
                .insert(index("units"), line);
        }
        all
    }

    fn number(line: &Line, name: &str) -> f64 {
        line[name].parse().unwrap_or_else(|_| panic!("{name}"))
    }

    fn area(line: &Line, schedule: &str, probe: &str) -> (f64, bool) {
        let area = number(line, &format!("{schedule}_{probe}_mm2"));
        let error = number(line, &format!("{schedule}_{probe}_error_mm2"));
        let mesh = MESH_ERROR * number(line, "reach_mm").powi(2);
        (area, area.abs() > error + mesh)
    }

    #[test]
    fn the_table_is_what_the_data_say() {
        let data = data();
        for measured in MEASURED {
            let [shares, large] = [0.0, LARGE_MM2]
                .map(|least| ["tip", "end"].map(|probe| share(&data, &measured, probe, least)));
            let worse = |s: [(f64, usize); 2]| if s[1].0 < s[0].0 { s[1] } else { s[0] };
            let (sign, compared) = worse(shares);
            assert!(
                (measured.sign - sign).abs() < 5e-4 && measured.compared == compared,
                "{measured:?}: {shares:?}"
            );
            assert!(
                (measured.sign_of_large - worse(large).0).abs() < 5e-4,
                "{measured:?}: {large:?}"
            );
        }
    }

    /// The share of designs whose sign agrees with that of a tip of nine units, of areas larger than `least`, and their number.
    fn share(data: &Data, measured: &Agreement, probe: &str, least: f64) -> (f64, usize) {
        let usable = |(units, line): (&usize, &Line)| {
            *units == 1 || (line["status"] == "ok" && line["unique"] == "True")
        };
        let (mut hits, mut count) = (0, 0);
        for lines in data.values().filter(|l| l.iter().all(usable)) {
            let (Some(few), Some(nine)) = (lines.get(&measured.units), lines.get(&WHOLE)) else {
                continue;
            };
            let (a, a_known) = area(few, measured.schedule, "tip");
            let (b, b_known) = area(nine, measured.schedule, probe);
            if a_known && b_known && a.abs() > least {
                count += 1;
                hits += usize::from(a * b > 0.0);
            }
        }
        (f64::from(hits as u32) / f64::from(count as u32), count)
    }

    #[test]
    fn schedules_are_known_in_either_order_and_direction() {
        let rows = |name: &str| ActuationCycle::named_rows(name, 12.5).expect("a name");
        for name in ["hold", "swap", "overlap"] {
            assert_eq!(name_of(&rows(name)), Some(name));
            let back: Vec<Vec<f64>> = rows(name).into_iter().rev().collect();
            assert_eq!(name_of(&back), Some(name));
        }
        // The preset `paper` drives the upper chamber first.
        let upper_first = [[0.0, 0.0], [0.0, 15.0], [15.0, 15.0], [0.0, 0.0]].map(Vec::from);
        assert_eq!(name_of(&upper_first), Some("hold"));
        let other = [[0.0, 0.0], [15.0, 3.0], [0.0, 0.0]].map(Vec::from);
        assert_eq!(fitness(&other, 3), Fitness::NotMeasured { units: 3 });
        assert_eq!(fitness(&rows("hold"), 4), Fitness::NotMeasured { units: 4 });
        assert_eq!(fitness(&rows("hold"), 9), Fitness::Whole);
        assert_eq!(Fitness::Whole.sentence(), None);
    }

    #[test]
    fn a_verdict_says_its_figures_and_what_to_use_instead() {
        for measured in MEASURED {
            let rows = ActuationCycle::named_rows(measured.schedule, 15.0).expect("a name");
            let verdict = fitness(&rows, measured.units);
            assert_eq!(
                matches!(verdict, Fitness::Fit(_)),
                measured.sign >= LEAST_AGREEMENT
            );
            let said = verdict.sentence().expect("a sentence");
            let share = format!(
                "{:.0} % of {} designs",
                100.0 * measured.sign,
                measured.compared
            );
            assert!(
                said.contains(&share) && said.contains(measured.schedule),
                "{said}"
            );
            assert_eq!(said.contains("unfit"), !measured.is_fit(), "{said}");
        }
    }
}

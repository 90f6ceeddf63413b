//! What restarts are worth, as numbers, tables and figures: of one step, or of several side by side.

use std::path::Path;

use salp_core::analysis::{ExpectedCost, Resampling, Sample, Trace, best_of_n, ratio};
use salp_core::picture::{BandPicture, BandSeries, BandStep, Scale, ScatterPicture, ScatterSeries};
use serde_json::{Value, json};

use super::StepRestarts;
use crate::failure::Failure;
use crate::output::{number, table, write_file};

/// Points of a curve against CPU time.
const POINTS: usize = 240;
/// Low end, middle and high end of the drawn bands; those of the table.
const BAND: [f64; 3] = [0.05, 0.5, 0.95];
const TABLE: [f64; 3] = [0.1, 0.5, 0.9];
/// Targets: the best of all given up by these shares.
const SHARES: [f64; 6] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
/// The target of the table, if none is asked for.
const SHARE: f64 = 0.02;
/// Beyond this ratio of their CPU times studies are drawn on a logarithmic axis.
const FAR_APART: f64 = 5.0;

/// Restarts with a name for legends and tables.
pub struct Named<'a> {
    /// The name.
    pub label: String,
    /// The restarts.
    pub step: &'a StepRestarts,
}

/// Restarts of one or more studies, analysed.
pub struct Analysis<'a> {
    studies: Vec<Named<'a>>,
    samples: Vec<Sample>,
    /// The best of all.
    best: Option<f64>,
    /// The value that counts as a success, and its words.
    target: Option<(f64, String)>,
    /// CPU time that every study has spent at least, s.
    equal_cpu_s: f64,
    resampling: Resampling,
}

/// A figure: stem of its files, what it shows, its picture and its numbers.
pub struct Figure {
    /// Stem of the files' names.
    pub stem: &'static str,
    /// What it shows.
    pub caption: &'static str,
    /// The picture.
    pub svg: String,
    /// The numbers.
    pub csv: String,
}

impl<'a> Analysis<'a> {
    /// Of studies, with a target or one within 2 % of the best of all.
    pub fn of(studies: Vec<Named<'a>>, target: Option<f64>) -> Self {
        let samples: Vec<Sample> = studies.iter().map(|s| s.step.sample()).collect();
        let best = samples.iter().filter_map(Sample::best).reduce(f64::min);
        let target = match (target, best) {
            (Some(target), _) => Some((target, "as asked for".to_owned())),
            (None, Some(best)) => {
                let words = format!("within {} % of the best of all", 100.0 * SHARE);
                Some((within(best, SHARE), words))
            }
            (None, None) => None,
        };
        let totals = samples.iter().map(Sample::total);
        Self {
            equal_cpu_s: totals.fold(f64::INFINITY, f64::min),
            studies,
            samples,
            best,
            target,
            resampling: Resampling::default(),
        }
    }

    fn expected(&self) -> Vec<ExpectedCost> {
        let Some((target, _)) = self.target else {
            return Vec::new();
        };
        let of = |sample| ExpectedCost::of(sample, target, self.resampling);
        self.samples.iter().map(of).collect()
    }

    /// All figures.
    pub fn figures(&self, title: &str, conditions: &[String]) -> Vec<Figure> {
        vec![
            self.best_of_n(title, conditions),
            self.waterfall(title, conditions),
            self.chances(title, conditions),
        ]
    }

    /// Writes the figures into a folder.
    pub fn write(figures: &[Figure], folder: &Path) -> Result<(), Failure> {
        for figure in figures {
            write_file(&folder.join(format!("{}.svg", figure.stem)), &figure.svg)?;
            write_file(&folder.join(format!("{}.csv", figure.stem)), &figure.csv)?;
        }
        Ok(())
    }

    fn unit(&self) -> String {
        match self.studies.first().map(|s| s.step.unit.as_str()) {
            None | Some("") => String::new(),
            Some(unit) => format!(" ({unit})"),
        }
    }

    /// N and the CPU time of each study.
    pub fn counts(&self) -> Vec<String> {
        let line = |(named, sample): (&Named<'_>, &Sample)| {
            let (starts, restarts) = (named.step.runs.len(), named.step.restarts());
            let twins = if restarts == starts {
                String::new()
            } else {
                format!(" ({restarts} restarts: each start in both senses of the area)")
            };
            let before = if sample.before > 0.0 {
                let before = number(Some(sample.before));
                format!(", {before} s of it in the steps that it takes from")
            } else {
                String::new()
            };
            format!(
                "{}: N = {starts} starts{twins}; {} s of CPU in all{before}",
                named.label,
                number(Some(sample.total()))
            )
        };
        self.studies.iter().zip(&self.samples).map(line).collect()
    }

    fn drawn(&self) -> String {
        format!(
            "starts drawn with replacement out of those that ran, one after the other: {} resamples, seed {}",
            self.resampling.resamples, self.resampling.seed
        )
    }

    fn caption(&self, words: String, conditions: &[String]) -> Vec<String> {
        let lines = self.counts().into_iter().chain([words]);
        lines.chain(conditions.iter().cloned()).collect()
    }

    fn level(&self) -> Option<(f64, String)> {
        let (target, words) = self.target.as_ref()?;
        Some((*target, format!("target: {words}")))
    }

    /// CPU times at which a study's curve is computed.
    fn costs(&self, sample: &Sample) -> Vec<f64> {
        let end = sample.total();
        let at = |k: usize| k as f64 / POINTS as f64;
        let first = sample.runs.iter().filter_map(|run| run.steps().first());
        let first = first.map(|step| step.0).reduce(f64::min).unwrap_or(0.0);
        let from = sample.before + first;
        match self.scale() {
            Scale::Logarithmic if from > 0.0 && end > from => (0..=POINTS)
                .map(|k| from * (end / from).powf(at(k)))
                .collect(),
            _ => (0..=POINTS).map(|k| from + (end - from) * at(k)).collect(),
        }
    }

    fn scale(&self) -> Scale {
        let totals = || self.samples.iter().map(Sample::total);
        let most = totals().fold(0.0, f64::max);
        if most > FAR_APART * self.equal_cpu_s {
            Scale::Logarithmic
        } else {
            Scale::Linear
        }
    }

    fn best_of_n(&self, title: &str, conditions: &[String]) -> Figure {
        let mut csv = String::from("study,cpu_s,low,median,high\n");
        let mut series = Vec::new();
        for (named, sample) in self.studies.iter().zip(&self.samples) {
            let costs = self.costs(sample);
            let found = best_of_n(sample, &costs, &BAND, self.resampling);
            let mut steps = Vec::new();
            for (at, values) in costs.into_iter().zip(found) {
                let [low, middle, high] = [values[0], values[1], values[2]];
                let cells =
                    [low, middle, high].map(|v| v.map_or_else(String::new, |v| v.to_string()));
                csv += &format!("{},{at},{}\n", quoted(&named.label), cells.join(","));
                let band = [low, high];
                steps.push(BandStep { at, middle, band });
            }
            let label = named.label.clone();
            series.push(BandSeries { label, steps });
        }
        let words = format!(
            "line: median of the best so far; band: {} to {} %; {}",
            100.0 * BAND[0],
            100.0 * BAND[2],
            self.drawn()
        );
        let picture = BandPicture {
            title: format!("{title}: best of N starts against CPU time"),
            x_label: "CPU time of all starts so far (s)".into(),
            y_label: format!("best objective so far{}", self.unit()),
            scales: [self.scale(), Scale::Linear],
            within: Vec::new(),
            // What is above the worst start's result is on its way there.
            top: self
                .samples
                .iter()
                .flat_map(|s| &s.runs)
                .filter_map(Trace::best)
                .reduce(f64::max),
            series,
            level: self.level(),
            caption: self.caption(words, conditions),
        };
        Figure {
            stem: "best-of-n",
            caption: "The best of N starts against CPU time",
            svg: picture.svg(),
            csv,
        }
    }

    fn waterfall(&self, title: &str, conditions: &[String]) -> Figure {
        let mut csv = String::from("study,rank,restarts,cpu_s,evaluations,objective\n");
        let mut series = Vec::new();
        let mut without = Vec::new();
        for named in &self.studies {
            let best = |run: &super::StartRun| run.best.last().map(|point| point[1]);
            let mut runs: Vec<&super::StartRun> = named.step.runs.iter().collect();
            let last = |run: &super::StartRun| best(run).unwrap_or(f64::INFINITY);
            runs.sort_by(|a, b| last(a).total_cmp(&last(b)));
            let share = |rank: usize| 100.0 * (rank + 1) as f64 / runs.len() as f64;
            let mut points = Vec::new();
            for (rank, run) in runs.iter().enumerate() {
                let restarts: Vec<String> = run.restarts.iter().map(usize::to_string).collect();
                csv += &format!(
                    "{},{},{},{},{},{}\n",
                    quoted(&named.label),
                    rank + 1,
                    restarts.join(" "),
                    run.cpu_s,
                    run.evaluations,
                    best(run).map_or_else(String::new, |v| v.to_string())
                );
                points.extend(best(run).map(|v| ([share(rank), v], String::new())));
            }
            let missing = runs.len() - points.len();
            if missing > 0 {
                without.push(format!(
                    "{}: {missing} starts found nothing that counts",
                    named.label
                ));
            }
            series.push(ScatterSeries {
                label: named.label.clone(),
                points,
                joined: true,
            });
        }
        let words = "each point a start: its best objective, the best start first".to_owned();
        let mut caption = self.caption(words, &without);
        caption.extend(conditions.iter().cloned());
        let picture = ScatterPicture {
            title: format!("{title}: starts by what they found"),
            x_label: "share of the starts (%)".into(),
            y_label: format!("best objective of a start{}", self.unit()),
            scales: [Scale::Linear; 2],
            series,
            level: self.level(),
            caption,
        };
        Figure {
            stem: "waterfall",
            caption: "Starts by what they found",
            svg: picture.svg(),
            csv,
        }
    }

    /// Targets of the figure of chances: several of one study, one of several.
    fn targets(&self) -> Vec<(f64, String)> {
        match (&self.target, self.best) {
            (Some(target), _) if self.studies.len() > 1 => vec![target.clone()],
            (_, Some(best)) => SHARES
                .iter()
                .map(|share| {
                    let words = format!("within {} % of the best", 100.0 * share);
                    (within(best, *share), words)
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Share of the starts that have come to a target, against the CPU time of a start (COCO's run-time distribution).
    fn chances(&self, title: &str, conditions: &[String]) -> Figure {
        let mut csv = String::from(
            "study,target,hits,starts,chance,chance_low,chance_high,mean_cpu_s,expected_cpu_s,expected_low_s,expected_high_s\n",
        );
        let mut series = Vec::new();
        let ends = self.samples.iter().flat_map(|s| &s.runs);
        let end = ends.map(Trace::total).fold(0.0, f64::max);
        for (target, words) in self.targets() {
            for (named, sample) in self.studies.iter().zip(&self.samples) {
                let found = ExpectedCost::of(sample, target, self.resampling);
                let cell = |v: Option<f64>| v.map_or_else(|| "inf".to_owned(), |v| v.to_string());
                csv += &format!(
                    "{},{target},{},{},{},{},{},{},{},{},{}\n",
                    quoted(&named.label),
                    found.hits,
                    found.runs,
                    found.chance,
                    found.chance_interval[0],
                    found.chance_interval[1],
                    found.mean_cost,
                    cell(found.expected),
                    cell(found.interval[0]),
                    cell(found.interval[1])
                );
                let mut costs: Vec<f64> = sample
                    .runs
                    .iter()
                    .filter_map(|run| run.cost_to(target))
                    .collect();
                costs.sort_by(f64::total_cmp);
                let share = |k: usize| 100.0 * k as f64 / sample.runs.len().max(1) as f64;
                let hits = costs.len();
                let steps = costs
                    .into_iter()
                    .enumerate()
                    .map(|(k, at)| BandStep::plain(at, share(k + 1)));
                let first = [BandStep::plain(0.0, 0.0)];
                let last = [BandStep::plain(end, share(hits))];
                let expected = format!("expected {} s", infinite(found.expected));
                series.push(BandSeries {
                    label: match self.studies.len() {
                        1 => format!("{words}: {expected}"),
                        _ => format!("{}: {expected}", named.label),
                    },
                    steps: first.into_iter().chain(steps).chain(last).collect(),
                });
            }
        }
        let target = self.target.as_ref().filter(|_| self.studies.len() > 1);
        let target = target.map_or_else(String::new, |(value, words)| {
            format!("target {} ({words}); ", number(Some(*value)))
        });
        let words = format!(
            "{target}expected CPU time: mean of a start, stopped at the target, over the share of starts that come to it, and what earlier steps took"
        );
        let picture = BandPicture {
            title: format!("{title}: chance of a start against its CPU time"),
            x_label: "CPU time of one start (s)".into(),
            y_label: "starts that came to the target (%)".into(),
            scales: [Scale::Linear, Scale::Linear],
            within: vec![0.0, 100.0],
            top: None,
            series,
            level: None,
            caption: self.caption(words, conditions),
        };
        Figure {
            stem: "chance",
            caption: "The chance of a start against its CPU time",
            svg: picture.svg(),
            csv,
        }
    }

    /// What was found for the CPU time that all have spent, chances, expected costs and their ratios to the first study's.
    pub fn document(&self) -> Value {
        let expected = self.expected();
        let rows: Vec<Value> = (0..self.studies.len())
            .map(|i| {
                let (named, sample) = (&self.studies[i], &self.samples[i]);
                let [low, median, high] = self.at_equal_cpu(sample);
                let mut row = json!({
                    "study": named.label,
                    "step": named.step.step,
                    "starts": sample.runs.len(),
                    "restarts": named.step.restarts(),
                    "cpu_s": sample.total(),
                    "before_cpu_s": sample.before,
                    "best": sample.best(),
                    "at_equal_cpu": { "median": median, "p10": low, "p90": high },
                });
                if let (Some(e), Some((target, _))) = (expected.get(i), &self.target) {
                    row["to_target"] = json!({
                        "hits": e.hits,
                        "chance": e.chance,
                        "chance_95": e.chance_interval,
                        "mean_cpu_s": e.mean_cost,
                        "expected_cpu_s": e.expected,
                        "expected_cpu_95_s": e.interval,
                    });
                    if i > 0 {
                        let r = ratio(sample, &self.samples[0], *target, self.resampling);
                        row["over_first"] = json!({ "ratio": r.ratio, "ratio_95": r.interval, "undecided": r.undecided });
                    }
                }
                row
            })
            .collect();
        json!({
            "equal_cpu_s": self.equal_cpu_s.is_finite().then_some(self.equal_cpu_s),
            "best": self.best,
            "target": self.target.as_ref().map(|t| t.0),
            "resamples": self.resampling.resamples,
            "seed": self.resampling.seed,
            "studies": rows,
        })
    }

    /// 10 %, median and 90 % of the best for the CPU time that all have spent.
    fn at_equal_cpu(&self, sample: &Sample) -> [Option<f64>; 3] {
        let found = best_of_n(sample, &[self.equal_cpu_s], &TABLE, self.resampling);
        [0, 1, 2].map(|k| found.first().and_then(|values| values[k]))
    }

    /// The same as lines for people.
    pub fn lines(&self) -> Vec<String> {
        let expected = self.expected();
        let mut rows = Vec::new();
        for (i, (named, sample)) in self.studies.iter().zip(&self.samples).enumerate() {
            let [low, median, high] = self.at_equal_cpu(sample);
            let mut row = vec![
                named.label.clone(),
                sample.runs.len().to_string(),
                number(Some(sample.total())),
                number(sample.best()),
                number(median),
                format!("{} to {}", number(low), number(high)),
            ];
            if let (Some(e), Some((target, _))) = (expected.get(i), &self.target) {
                let [from, to] = e.chance_interval.map(|c| infinite(Some(100.0 * c)));
                row.push(format!(
                    "{} ({from} to {to})",
                    infinite(Some(100.0 * e.chance))
                ));
                let [from, to] = e.interval.map(infinite);
                row.push(format!("{} ({from} to {to})", infinite(e.expected)));
                if i > 0 {
                    let r = ratio(sample, &self.samples[0], *target, self.resampling);
                    let [from, to] = r.interval.map(infinite);
                    row.push(if expected.first().is_some_and(|first| first.hits == 0) {
                        "the first never came there".to_owned()
                    } else {
                        format!("{} ({from} to {to})", infinite(r.ratio))
                    });
                }
            }
            rows.push(row);
        }
        let mut header = vec!["study", "starts", "CPU s", "best", "median", "10 to 90 %"];
        if self.target.is_some() {
            header.extend(["chance % (95 %)", "expected CPU s (95 %)"]);
            if self.studies.len() > 1 {
                header.push("over the first (95 %)");
            }
        }
        let mut lines = self.counts();
        lines.push(format!(
            "median and 10 to 90 %: the best for {} s of CPU; {}",
            number(Some(self.equal_cpu_s)),
            self.drawn()
        ));
        if let Some((target, words)) = &self.target {
            lines.push(format!(
                "target {}{}, {words}: chance of a start; expected CPU time to it",
                number(Some(*target)),
                self.unit()
            ));
        }
        lines.push(table(&header, &rows));
        lines.extend(self.first_order());
        lines
    }

    /// How near the ends of the starts are to optima.
    fn first_order(&self) -> Vec<String> {
        let line = |named: &Named<'_>| {
            let residuals = named.step.first_order_residuals();
            let median = residuals.get(residuals.len() / 2)?;
            let met = |to: f64| residuals.iter().filter(|r| **r <= to).count();
            Some(format!(
                "{}: first-order conditions at the best design of {} starts: met to 1e-3 of the objective's gradient by {}, to 1e-2 by {}; median {}",
                named.label,
                residuals.len(),
                met(1e-3),
                met(1e-2),
                number(Some(*median))
            ))
        };
        self.studies.iter().filter_map(line).collect()
    }
}

fn within(best: f64, share: f64) -> f64 {
    best + share * best.abs()
}

/// With three significant digits: what is drawn at random has no more.
fn infinite(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "inf".to_owned();
    };
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    number(Some(rounded))
}

/// A cell of CSV: a study's name may hold anything.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

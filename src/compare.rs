//! `salp compare`: studies at equal CPU time.

use std::path::{Path, PathBuf};

use clap::Args;
use salp_core::fault::Faults;
use salp_core::study::read_study;
use serde_json::{Value, json};

use crate::client::{ClientArguments, StudyArguments};
use crate::failure::Failure;
use crate::output::{Output, write_file};
use crate::restarts::{
    Analysis, Difference, FILE, Named, StepRestarts, StudyRestarts, differences,
};
use crate::run::document::Results;

/// Arguments of `salp compare`.
#[derive(Args)]
pub struct Compare {
    /// Folders of `salp run` or of reports; ids of a coordinator's studies
    #[arg(required = true, num_args = 1.., value_name = "STUDY")]
    studies: Vec<String>,
    #[command(flatten)]
    client: ClientArguments,
    /// The step that is compared, of each study [default: the last one that has found something]
    #[arg(long, value_name = "ID")]
    step: Option<String>,
    /// Objective from which a start counts as a success [default: within 2 % of the best of all]
    #[arg(long, allow_negative_numbers = true)]
    target: Option<f64>,
    /// Sets studies beside each other that sought other things, or under other limits
    #[arg(long)]
    anyway: bool,
    /// Folder of the figures and tables
    #[arg(long)]
    out: Option<PathBuf>,
}

impl Compare {
    /// Reads, compares, prints.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let studies = self.read()?;
        let steps = self.steps(&studies)?;
        let conditions = |of: fn(&StepRestarts) -> &serde_json::Map<String, Value>| {
            let maps: Vec<_> = steps.iter().map(|step| of(step)).collect();
            differences(&maps)
        };
        let held_to = conditions(|step| &step.conditions.held_to);
        let sought_by = conditions(|step| &step.conditions.sought_by);
        let labels = labels(&self.studies, &studies, &steps);
        if !self.anyway {
            refuse(&held_to, &labels)?;
        }
        let named = labels.iter().zip(&steps);
        let named = named.map(|(label, step)| Named {
            label: label.clone(),
            step,
        });
        let analysis = Analysis::of(named.collect(), self.target);
        let unlike: Vec<String> = held_to
            .iter()
            .map(|d| format!("not alike: {}", words(d, &labels)))
            .collect();
        let mut document = analysis.document();
        document["status"] = json!("ok");
        document["not_alike"] = json!(held_to);
        document["sought_by"] = json!(sought_by);
        let mut lines = unlike.clone();
        lines.extend(analysis.lines());
        lines.extend(sought_by.iter().map(|d| words(d, &labels)));
        let unfinished = self.studies.iter().zip(&studies);
        let unfinished = unfinished.filter(|(_, study)| study.state != "done");
        lines.extend(
            unfinished
                .map(|(name, study)| format!("{name} is {}: what it has so far", study.state)),
        );
        if let Some(folder) = &self.out {
            let title = if studies.len() == 1 {
                &studies[0].name
            } else {
                "comparison"
            };
            let figures = analysis.figures(title, &unlike);
            Analysis::write(&figures, folder)?;
            let files: Vec<String> = figures.iter().map(|f| format!("{}.svg", f.stem)).collect();
            document["files"] = json!(files);
            let pretty = serde_json::to_string_pretty(&document).unwrap_or_default();
            write_file(&folder.join("compare.json"), &pretty)?;
            write_file(
                &folder.join("compare.txt"),
                &format!("{}\n", lines.join("\n")),
            )?;
            lines.push(format!("figures and tables in {}", folder.display()));
        }
        output.print(&document, || lines.join("\n"));
        Ok(())
    }

    fn read(&self) -> Result<Vec<StudyRestarts>, Failure> {
        let mut faults = Faults::default();
        let mut studies = Vec::new();
        for (i, name) in self.studies.iter().enumerate() {
            match self.read_one(name) {
                Ok(study) => studies.push(study),
                Err(Failure::BadInput(wrong)) => {
                    let messages = wrong.0.into_iter().map(|fault| fault.message);
                    for message in messages {
                        faults.add(format!("study[{i}]"), message);
                    }
                }
                Err(other) => return Err(other),
            }
        }
        Ok(faults.check(studies)?)
    }

    /// A folder, or else an id.
    fn read_one(&self, name: &str) -> Result<StudyRestarts, Failure> {
        let folder = Path::new(name);
        if !folder.exists() {
            let is_path = name.contains(['/', '\\', '.']);
            if is_path {
                return Err(Failure::fault("", format!("there is no folder {name}")));
            }
            return self.fetch(name);
        }
        let places = [
            folder.join("report").join(FILE),
            folder.join(FILE),
            folder.to_owned(),
        ];
        let Some(file) = places.iter().find(|file| file.is_file()) else {
            return Err(Failure::fault(
                "",
                format!(
                    "{name} holds no {FILE}: `salp run` and `salp report` write it into the folder of the report; the same `salp run` again writes that of a study that has ended"
                ),
            ));
        };
        let unreadable = |why: String| Failure::fault("", format!("{}: {why}", file.display()));
        let text = std::fs::read_to_string(file).map_err(|e| unreadable(e.to_string()))?;
        StudyRestarts::read(&text).map_err(unreadable)
    }

    fn fetch(&self, id: &str) -> Result<StudyRestarts, Failure> {
        let arguments = StudyArguments {
            study: id.to_owned(),
            client: self.client.clone(),
        };
        let (client, id) = arguments.open()?;
        let study = read_study(&client.document(&id)?, true)?;
        let results = Results::fetch(&client, &id, &study, 0.0)?;
        Ok(StudyRestarts::of(&study, &results))
    }

    fn steps<'a>(&self, studies: &'a [StudyRestarts]) -> Result<Vec<&'a StepRestarts>, Failure> {
        let mut faults = Faults::default();
        let mut steps = Vec::new();
        for (i, study) in studies.iter().enumerate() {
            match study.step(self.step.as_deref()) {
                Some(step) if step.sample().best().is_some() => steps.push(step),
                Some(step) => faults.add(
                    format!("study[{i}]"),
                    format!(
                        "no start of step {} has found anything that counts",
                        step.step
                    ),
                ),
                None => {
                    let ids: Vec<&str> = study.steps.iter().map(|s| s.step.as_str()).collect();
                    let message = match &self.step {
                        Some(id) => format!(
                            "no step with restarts is named \"{id}\"; there are {}",
                            ids.join(", ")
                        ),
                        None => "it has no restarts".into(),
                    };
                    faults.add(format!("study[{i}]"), message);
                }
            }
        }
        Ok(faults.check(steps)?)
    }
}

/// Names of the studies; where two are alike, with their steps, else as they were given.
fn labels(given: &[String], studies: &[StudyRestarts], steps: &[&StepRestarts]) -> Vec<String> {
    let names: Vec<String> = studies.iter().map(|study| study.name.clone()).collect();
    let with_steps = || -> Vec<String> {
        let both = names.iter().zip(steps);
        both.map(|(name, step)| format!("{name}: {}", step.step))
            .collect()
    };
    let distinct = |labels: &[String]| {
        let mut sorted = labels.to_vec();
        sorted.sort();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    };
    [names.clone(), with_steps()]
        .into_iter()
        .find(|labels| distinct(labels))
        .unwrap_or_else(|| given.to_vec())
}

fn refuse(differing: &[Difference], labels: &[String]) -> Result<(), Failure> {
    let mut faults = Faults::default();
    for difference in differing {
        faults.add(
            "study",
            format!(
                "cannot be compared, {}; --anyway sets them beside each other",
                words(difference, labels)
            ),
        );
    }
    Ok(faults.check(())?)
}

fn words(difference: &Difference, labels: &[String]) -> String {
    let each: Vec<String> = labels
        .iter()
        .zip(&difference.values)
        .map(|(label, value)| match value {
            Value::Null => format!("none in {label}"),
            value => format!("{value} in {label}"),
        })
        .collect();
    format!("{}: {}", difference.condition, each.join(", "))
}

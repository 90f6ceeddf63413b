//! How the steps of a study hang together: what a step takes from others, which pass of the framework it belongs to, by
//! which simplifications it stands for the design (Figs. 1 and 2 of the paper).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::error::StudyError;
use super::spec::{FeLayoutsModel, Model, Study, StudyActuator};
use crate::geometry::Layout;
use crate::reduced::{LinearTransform, Strain};
use crate::scene::Orientation;

/// The pass of the framework to which a hierarchical step belongs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pass {
    /// From level 1 down: it simplifies, and says what the levels below are to reach.
    Forward,
    /// From the last level up: it solves, and hands candidates up.
    #[default]
    Backward,
}

/// What a step takes from another one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Take {
    /// Id of the other step.
    pub step: String,
    /// As what.
    #[serde(rename = "as")]
    pub taken_as: TakenAs,
    /// The units, counted from 1, whose chambers it gives; of an alphabet those of the other step's design. Empty: all of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub units: Vec<usize>,
    /// How many of its candidates are taken, from the best on.
    pub candidates: usize,
}

/// As what a step takes the candidates of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TakenAs {
    /// Start points of its restarts.
    Starts,
    /// Designs that a sweep evaluates as they are.
    Geometry,
    /// Units of which sequences are made.
    Alphabet,
    /// The chamber layout of the best one.
    Layout,
    /// The transformations that the best one asks for.
    Behaviour,
}

/// By what a step stands for the design of the level above it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Simplification {
    /// All units are copies of one.
    Repeat,
    /// A chain of fewer units, or a reduced model, stands for the whole.
    Reduce,
    /// The step designs a part of the actuator: some units of it.
    Split,
    /// The unit is symmetric about its middle height.
    Symmetry,
}

impl Simplification {
    /// Its name in documents.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Reduce => "reduce",
            Self::Split => "split",
            Self::Symmetry => "symmetry",
        }
    }
}

/// What a step is given by others beside its designs: it changes what an evaluation of the step means.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Given {
    /// Chamber layout, in place of the actuator's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<Layout>,
    /// Transformations of a unit that are asked for, in the order of the actuations.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub behaviour: Vec<LinearTransform>,
    /// Units of which its sequences are made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alphabet: Vec<Letter>,
}

/// A unit of which sequences are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Letter {
    /// Chamber corners `[x1, y1, ...]`, mm.
    pub corners: Vec<f64>,
    /// Which unit of the candidate it is, from 1.
    pub unit: usize,
    /// The candidate.
    pub from: TakenFrom,
}

impl Given {
    /// Whether nothing is given.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// All that a step takes, once it is there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepInputs {
    /// What changes the meaning of its evaluations.
    #[serde(default, skip_serializing_if = "Given::is_empty")]
    pub given: Given,
    /// Starts, or designs to be evaluated, the best first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub designs: Vec<TakenDesign>,
}

/// A design put together from candidates of other steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TakenDesign {
    /// Design variables of the step that takes it.
    pub x: Vec<f64>,
    /// The sense in which its area counted where it comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<Orientation>,
    /// The candidates of which it is made.
    pub from: Vec<TakenFrom>,
}

/// A candidate of another step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TakenFrom {
    /// Id of the step.
    pub step: String,
    /// Its rank there, from 0.
    pub candidate: usize,
    /// Its objective there.
    pub objective: f64,
}

impl FeLayoutsModel {
    /// The layout of a design, and the sides of its chambers in shares of their domains.
    pub fn at(&self, x: &[f64]) -> (Layout, [f64; 2]) {
        let index = x.first().map_or(0, |k| k.round().max(0.0) as usize);
        let last = self.layouts.len().saturating_sub(1);
        let share = |k: usize| x.get(k).copied().unwrap_or(1.0);
        // A document offers one layout at least.
        let layout = self
            .layouts
            .get(index.min(last))
            .copied()
            .unwrap_or(Layout::StackedPair);
        (layout, [share(1), share(2)])
    }
}

impl StudyActuator {
    /// The same with another layout.
    #[must_use]
    pub fn with_layout(&self, layout: Layout) -> Self {
        Self {
            layout,
            ..self.clone()
        }
    }

    /// Chamber corners of rectangles whose sides are these shares of their domains'.
    pub fn shares(&self, shares: [f64; 2]) -> Vec<f64> {
        let boxes = self.boxes();
        let [least, most] = boxes.rectangle_bounds();
        boxes.rectangles([0, 1].map(|c| (shares[c] * most[c]).max(least[c])))
    }
}

impl Study {
    /// The study as a step means it with what it was given.
    pub fn given(&self, step: usize, given: &Given) -> Cow<'_, Self> {
        if given.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut study = self.clone();
        if let Some(step) = study.steps.get_mut(step) {
            step.given = given.clone();
        }
        Cow::Owned(study)
    }

    /// The study of a step and of all that it takes from, directly or not; `None` if no step has that name.
    #[must_use]
    pub fn needed_for(&self, id: &str) -> Option<Self> {
        let mut needed = vec![self.index_of(id)?];
        let mut next = 0;
        while next < needed.len() {
            let sources = self.steps[needed[next]].takes.iter();
            for source in sources.filter_map(|take| self.index_of(&take.step)) {
                if !needed.contains(&source) {
                    needed.push(source);
                }
            }
            next += 1;
        }
        needed.sort_unstable();
        let mut study = self.clone();
        study.steps = needed
            .iter()
            .map(|step| self.steps[*step].clone())
            .collect();
        Some(study)
    }

    /// The chamber layout of a step; `None` of a study without chambers.
    pub fn layout(&self, step: usize) -> Option<Layout> {
        let of_actuator = self.body.as_ref().map(|body| body.actuator.layout);
        let given = self.steps.get(step).and_then(|step| step.given.layout);
        given.or(of_actuator)
    }

    /// The chamber layout of a step's design.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn layout_of(&self, step: usize, x: &[f64]) -> Result<Option<Layout>, StudyError> {
        Ok(match &self.step(step)?.model {
            Model::FeLayouts(model) => Some(model.at(x).0),
            Model::FeCascade(_) | Model::FeDirect(_) => self.layout(step),
            Model::LinearTransform(_) | Model::ConstantStrain(_) | Model::Command(_) => None,
        })
    }

    /// The transformations that a design of a reduced model stands for; none of any other model.
    ///
    /// # Errors
    /// Where the study has no such step.
    pub fn transforms_of(
        &self,
        step: usize,
        x: &[f64],
    ) -> Result<Vec<LinearTransform>, StudyError> {
        let width = self.body.as_ref().map_or(1.0, |b| b.actuator.unit_mm[0]);
        Ok(match self.step(step)?.model {
            Model::LinearTransform(_) => {
                let (entries, _) = x.as_chunks::<4>();
                entries.iter().map(LinearTransform::from_slice).collect()
            }
            Model::ConstantStrain(_) => {
                let strains = strains_of(x, width);
                strains.iter().map(|s| s.transform(width)).collect()
            }
            _ => Vec::new(),
        })
    }

    /// Chamber corners of a step's design, one list for each free unit.
    ///
    /// # Errors
    /// Where the step has no chambers, or the design does not fit it.
    pub fn unit_corners(&self, step: usize, x: &[f64]) -> Result<Vec<Vec<f64>>, StudyError> {
        if let Model::FeLayouts(model) = &self.step(step)?.model {
            let (layout, shares) = model.at(x);
            let body = self.body.as_ref().ok_or(StudyError::NoChambers { step })?;
            return Ok(vec![body.actuator.with_layout(layout).shares(shares)]);
        }
        let corners = self.corners(step, x)?;
        let of_unit = corners.len() / self.free_units(step)?.max(1);
        Ok(corners
            .chunks(of_unit.max(1))
            .map(<[f64]>::to_vec)
            .collect())
    }

    /// Index of the step of a name.
    pub fn index_of(&self, id: &str) -> Option<usize> {
        self.steps.iter().position(|step| step.id == id)
    }
}

/// The strains of the variables of a constant-strain model, `[turn (rad), extension, shear]` for each actuation of a unit of this
/// width.
pub fn strains_of(x: &[f64], width_mm: f64) -> Vec<Strain> {
    let (entries, _) = x.as_chunks::<3>();
    let strain = |[turn, extension, shear]: &[f64; 3]| {
        Strain::from_parts([turn / width_mm, *extension, *shear])
    };
    entries.iter().map(strain).collect()
}

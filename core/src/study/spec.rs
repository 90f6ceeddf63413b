//! The study document, resolved: what is designed, from what, by which optimiser, from which starts.
//!
//! Every type serialises to the form of the document, so that [`Study::document`] reads back to an equal study. Lengths
//! in mm, stress in MPa, pressure in kPa.

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

pub use super::model::{
    AccuracyDesign, ChosenMesh, CommandModel, FeLayoutsModel, FeModel, LayoutScore, MeshAccuracy,
    Model, ReducedModel,
};
use super::race::Competition;
use super::result::is_false;
use super::takes::{Given, Pass, Simplification, Take};
use crate::actuation::ActuationCycle;
use crate::geometry::{ChamberCorners, Layout, Point};
use crate::material::{MaterialLaw, records};
use crate::optimiser::OptimiserOptions;
use crate::scene::measure::{Bound, Goal, Measure};
use crate::scene::{Orientation, material_document};

/// A study whose document had no fault.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Its name, for people and for the default folder of results.
    pub name: String,
    /// What the finite-element models of the steps share; `None` where every step is a command model.
    #[serde(flatten)]
    pub body: Option<StudyBody>,
    /// Whether workers of any build and instruction set may join: its history is then the same to solver tolerance only.
    #[serde(skip_serializing_if = "is_false")]
    pub mixed_hardware: bool,
    /// Whether each new best so far of a finite-element step is evaluated on a second mesh too.
    #[serde(skip_serializing_if = "is_true")]
    pub error_bands: bool,
    /// Whether workers that nothing else needs evaluate what an optimiser will probably ask next.
    #[serde(skip_serializing_if = "is_false")]
    pub speculate: bool,
    /// The steps, in the document's order.
    #[serde(rename = "step")]
    pub steps: Vec<StudyStep>,
}

/// Actuator, material and actuation of the finite-element models.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyBody {
    /// The chain of units and where its chambers may lie.
    pub actuator: StudyActuator,
    /// What it is made of.
    #[serde(flatten)]
    pub material: StudyMaterials,
    /// Pressures over pseudo-time.
    #[serde(serialize_with = "actuation_as_document")]
    pub actuation: ActuationCycle,
}

/// A chain of units of one size and the domains of their chambers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyActuator {
    /// Width and height of a unit.
    pub unit_mm: [f64; 2],
    /// Number of units.
    pub units: usize,
    /// Which chambers a unit holds.
    pub layout: Layout,
    /// Corners of each chamber.
    #[serde(skip_serializing_if = "is_four")]
    pub corners: ChamberCorners,
    /// Least distance from a chamber's domain to the unit's boundary, and between the two domains.
    pub wall_mm: f64,
    /// Distance that each corner keeps from the centre lines of its chamber's domain.
    pub centre_clearance_mm: f64,
    /// Radius of the chambers' corners; 0: sharp. The variables are the unrounded corners.
    pub corner_radius_mm: f64,
}

/// What the units are made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum StudyMaterials {
    /// All of one material.
    #[serde(rename = "material")]
    All(StudyMaterial),
    /// One material per unit.
    #[serde(rename = "unit_materials")]
    PerUnit(Vec<StudyMaterial>),
}

/// A law, and the record that it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyMaterial {
    /// Name of the record; `None` for a law that the document gives itself.
    pub record: Option<String>,
    /// Parameters.
    pub law: MaterialLaw,
}

/// One step: an optimisation from several starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyStep {
    /// Its name, unique in the study.
    pub id: String,
    /// Level of the framework, from 1 (the whole actuator) upwards (simpler models).
    pub level: usize,
    /// Pass of the framework.
    #[serde(skip_serializing_if = "is_backward")]
    pub pass: Pass,
    /// By what it stands for the level above it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub simplifies: Vec<Simplification>,
    /// What it takes from other steps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub takes: Vec<Take>,
    /// What it was given by them; empty in a document.
    #[serde(skip)]
    pub given: Given,
    /// What is minimised; `None` for a command model, which gives its objective itself.
    pub target: Option<Target>,
    /// What evaluates a design.
    pub model: Model,
    /// What may vary, and between which bounds.
    pub variables: Variables,
    /// What must hold.
    pub constraints: StepConstraints,
    /// Who chooses the next design.
    pub optimiser: OptimiserOptions,
    /// Where it starts; a sweep and an exchange descent have no starts.
    #[serde(skip_serializing_if = "Restarts::is_empty")]
    pub restarts: Restarts,
    /// When it must end at the latest.
    pub budget: Budget,
    /// How many distinct candidates are kept.
    pub keeps: usize,
}

/// What is minimised over the actuation cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The measure, of points in the reference shape, and what is done with it.
    pub goal: Goal<Point>,
    /// Whether an enclosed area counts in either sense: each start becomes two restarts, one of each sense; a sweep is one
    /// restart, whose points count in their better sense.
    pub either_sense: bool,
}

/// What may vary.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Variables {
    /// Chamber corners, bounded by the boxes of the actuator's layout.
    Chambers {
        /// How the variables give the corners.
        parametrisation: Parametrisation,
        /// Corners of each chamber, where they are not as many as the actuator's.
        #[serde(skip_serializing_if = "Option::is_none")]
        corners: Option<ChamberCorners>,
    },
    /// The variables of a command model.
    Bounds {
        /// Lower bounds.
        lower: Vec<f64>,
        /// Upper bounds.
        upper: Vec<f64>,
    },
}

/// How design variables give chamber corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parametrisation {
    /// `[x1, y1, ..., x8, y8]` (Eq. 2), of hexagons to `y12`: the corners themselves, chamber after chamber; with free units one such list after
    /// the other, from the clamped end.
    Corners,
    /// `[width, height]`: two equal rectangles, each at its domain's centre.
    Rectangle,
    /// One index for each free unit, from 0, into the units that the step takes from others as its alphabet.
    Sequence,
}

/// What must hold, feasible when <= 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum StepConstraints {
    /// Of finite-element models: spike rows and wall rows of each free unit, then a stretch row per chamber corner of a
    /// unit, another at the load margin, a gap row per chamber of a unit, and a row per end of each bound.
    Chambers(ChamberConstraints),
    /// Of command models: how many values the program gives.
    Counts {
        /// Feasible when <= 0.
        inequalities: usize,
        /// Feasible when 0; they follow the inequalities.
        equalities: usize,
    },
}

/// Constraints of a finite-element model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChamberConstraints {
    /// Least wall thickness t_min: 1 - t / t_min <= 0.
    pub wall_mm: f64,
    /// Least interior angle of a chamber's corner, degrees.
    pub spike_deg: f64,
    /// Limit of the averaged principal stretch.
    pub stretch: StretchLimit,
    /// Radius of the disc over which the stretch is averaged.
    pub stretch_length_mm: f64,
    /// Least gap between facing walls of a chamber, mm.
    pub wall_gap_mm: NumberOrOff,
    /// Stable equilibria that keep the stretch limit exist up to this many times every loaded row of the schedule.
    pub load_margin: NumberOrOff,
    /// Whether a design counts as failed whose path meets a second equilibrium.
    pub exclude_non_unique: bool,
    /// Bounds on measures over the path.
    #[serde(serialize_with = "bounds_as_documents")]
    pub bounds: Vec<Bound<Point>>,
}

/// A limit that may be switched off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NumberOrOff {
    /// The limit.
    Number(f64),
    /// None.
    Off,
}

impl NumberOrOff {
    /// The number; `None` where it is off.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(value),
            Self::Off => None,
        }
    }
}

/// Limit of the averaged principal stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StretchLimit {
    /// That of the material's record.
    Material,
    /// A number above 1.
    Value(f64),
    /// None.
    Off,
}

/// Where the optimiser starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Restarts {
    /// Kinds of starts, in their order.
    pub start: Vec<StartKind>,
    /// The points of `given`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Vec<f64>>,
    /// How many starts each kind draws that draws them.
    #[serde(skip_serializing_if = "is_zero")]
    pub count: usize,
    /// Seed of what is drawn.
    pub seed: u64,
    /// A start nearer than this to another one is drawn again: the largest difference of a variable over its range.
    #[serde(skip_serializing_if = "is_the_default_distance")]
    pub least_distance: f64,
    /// How they compete.
    #[serde(flatten)]
    pub competition: Competition,
}

/// A kind of start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartKind {
    /// The paper's: a void of 1 x 1 mm at the centre of every chamber's domain.
    Paper,
    /// Points of the document.
    Given,
    /// Candidates of other steps.
    Taken,
    /// Points drawn uniformly from the bounds.
    Random,
    /// Points of a Latin hypercube: of `count` strata of each variable every one has one.
    LatinHypercube,
    /// Points of a scrambled Sobol sequence.
    Sobol,
}

impl StartKind {
    /// Whether its starts are drawn: `count` of them.
    pub fn is_drawn(self) -> bool {
        matches!(self, Self::Random | Self::LatinHypercube | Self::Sobol)
    }
}

/// The least distance of two starts where a document gives none.
pub const LEAST_DISTANCE: f64 = 0.01;

/// When a step must end at the latest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Budget {
    /// Evaluations of the step, shared equally between its restarts so that the outcome does not depend on who is first.
    pub evaluations: Option<usize>,
}

impl Study {
    /// The resolved document: every default filled in; it reads back to an equal study.
    pub fn document(&self) -> Value {
        // The types hold nothing that JSON cannot express: finite numbers, text keys.
        serde_json::to_value(self).unwrap_or_default()
    }
}

impl StudyBody {
    /// The stretch limit of a step's constraints as a number; `None` where it is off.
    pub fn stretch_limit(&self, constraints: &ChamberConstraints) -> Option<f64> {
        match constraints.stretch {
            StretchLimit::Off => None,
            StretchLimit::Value(limit) => Some(limit),
            StretchLimit::Material => self.material.stretch_limit(),
        }
    }
}

impl StudyMaterials {
    /// The law of each of `units` units.
    pub fn laws(&self, units: usize) -> Vec<MaterialLaw> {
        match self {
            Self::All(material) => vec![material.law; units],
            Self::PerUnit(materials) => materials.iter().map(|m| m.law).collect(),
        }
    }

    /// The materials, one for all or one per unit.
    pub fn each(&self) -> &[StudyMaterial] {
        match self {
            Self::All(material) => std::slice::from_ref(material),
            Self::PerUnit(materials) => materials,
        }
    }

    /// The least of their stretch limits, where every one has one.
    pub fn stretch_limit(&self) -> Option<f64> {
        let limits: Option<Vec<f64>> = self
            .each()
            .iter()
            .map(StudyMaterial::stretch_limit)
            .collect();
        limits?.into_iter().reduce(f64::min)
    }
}

impl StudyMaterial {
    /// The stretch limit of its record, or the end of the range that its document gives, where it has one.
    pub fn stretch_limit(&self) -> Option<f64> {
        match &self.record {
            Some(name) => records::find(name)?.stretch_limit(),
            None => self.law.fit_stretch,
        }
    }
}

impl Target {
    /// The senses in which restarts run; `None` for a target without one.
    pub fn senses(&self) -> Vec<Option<Orientation>> {
        match self.goal.measure {
            Measure::EnclosedArea { .. } if self.either_sense => vec![
                Some(Orientation::CounterClockwise),
                Some(Orientation::Clockwise),
            ],
            Measure::EnclosedArea { orientation, .. } => vec![Some(orientation)],
            _ => vec![None],
        }
    }
}

impl Serialize for Target {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = self.goal.document("_mm", |p| json!(p));
        if self.either_sense {
            map.insert("orientation".into(), json!("either"));
        }
        map.serialize(serializer)
    }
}

fn bounds_as_documents<S: Serializer>(
    bounds: &[Bound<Point>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(bounds.iter().map(|b| b.document("_mm", |p| json!(p))))
}

impl Serialize for StudyMaterial {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.record {
            Some(name) => serializer.serialize_str(name),
            None => material_document(&self.law).serialize(serializer),
        }
    }
}

impl Serialize for StretchLimit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Material => serializer.serialize_str("material"),
            Self::Value(limit) => serializer.serialize_f64(*limit),
            Self::Off => serializer.serialize_str("off"),
        }
    }
}

impl Serialize for NumberOrOff {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(value) => serializer.serialize_f64(*value),
            Self::Off => serializer.serialize_str("off"),
        }
    }
}

fn actuation_as_document<S: Serializer>(
    cycle: &ActuationCycle,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    crate::scene::actuation::actuation_document(cycle).serialize(serializer)
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_backward(pass: &Pass) -> bool {
    *pass == Pass::Backward
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_four(corners: &ChamberCorners) -> bool {
    *corners == ChamberCorners::Four
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_true(flag: &bool) -> bool {
    *flag
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_the_default_distance(distance: &f64) -> bool {
    *distance == LEAST_DISTANCE
}

//! What evaluates a design, resolved: finite elements, a reduced model or a program, with its settings.
//!
//! Every type serialises to the form of the document. Lengths in mm.

use serde::Serialize;

use crate::geometry::Layout;
use crate::reduced::LinearTransform;
use crate::scene::{ContactMode, ElementChoice, MeshRequest};

/// What evaluates a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Model {
    /// Finite elements on a chain of copies of one unit.
    FeCascade(FeModel),
    /// Finite elements on a chain whose units are all free.
    FeDirect(FeModel),
    /// Finite elements on one unit of each of several chamber layouts.
    FeLayouts(FeLayoutsModel),
    /// The reduced model of a chain: a transformation of a unit per actuation (Eq. 1).
    LinearTransform(ReducedModel),
    /// The reduced model of a chain: constant strains of a unit per actuation.
    ConstantStrain(ReducedModel),
    /// A program.
    Command(CommandModel),
}

/// One unit of each of several chamber layouts, each with equal rectangles in its domains: how near do its transformations come
/// to what is asked for?
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeLayoutsModel {
    /// The layouts on offer; the first variable is an index into them.
    pub layouts: Vec<Layout>,
    /// Transformations of a unit that are asked for, one per loaded row of the schedule; empty where another step gives them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub behaviour: Vec<LinearTransform>,
    /// By what a unit is held against them.
    pub score: LayoutScore,
    /// Settings of the elements.
    #[serde(flatten)]
    pub fe: FeModel,
}

/// How near a unit comes to transformations that are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LayoutScore {
    /// What is missing of the area that a cascade of them encloses, 1 - |A| / |A asked|.
    #[default]
    Area,
    /// The distance of the entries over that of the asked ones from rest.
    Distance,
}

/// A reduced model of a chain of equal units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ReducedModel {
    /// Number of units; `None`: that of the actuator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<usize>,
    /// Number of actuations, each a transformation of a unit, or its strains; the last one is followed by rest.
    pub actuations: usize,
}

/// Settings of a finite-element model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeModel {
    /// Number of units; `None`: that of the actuator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<usize>,
    /// Element family.
    pub element: ElementChoice,
    /// No element edge longer than this; `None`: the size rule for 1 % of the tip displacement.
    pub max_size_mm: Option<f64>,
    /// As many elements as squares of this side fill the solid, in place of a longest edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_size_mm: Option<f64>,
    /// A state is accepted when its largest free nodal residual is below this times the largest nodal force.
    pub relative_residual_force_tolerance: f64,
    /// Self-contact.
    pub contact: ContactMode,
    /// Surfaces farther apart than this do not act on each other, mm.
    pub contact_activation_mm: f64,
    /// The error for which element and size are chosen, where the document asks for that.
    #[serde(rename = "mesh", skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<MeshAccuracy>,
}

impl FeModel {
    /// The mesh that a scene of this model asks for.
    pub(crate) fn mesh(&self) -> MeshRequest {
        MeshRequest {
            element: self.element,
            max_size_mm: self.max_size_mm,
            mean_size_mm: self.mean_size_mm,
        }
    }
}

/// Element and size chosen for an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshAccuracy {
    /// The relative error wanted in the tip's displacement and in the enclosed area.
    pub error: f64,
    /// What was found; `None` until element and size are chosen, which is before a study is stored: every worker then has
    /// the same settings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<ChosenMesh>,
}

/// What the chosen element and size were seen to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenMesh {
    /// The design at which errors were measured.
    pub at: AccuracyDesign,
    /// Error of the tip at the rows of the schedule, over its largest displacement.
    pub tip_error: f64,
    /// Relative error of the enclosed area, where that is the target.
    pub area_error: Option<f64>,
    /// How uncertain the reference is, relative, in the larger of the two; part of what must be within the wanted error.
    pub uncertainty: f64,
    /// Number of elements there.
    pub elements: usize,
}

/// A design at which errors are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyDesign {
    /// The first given start.
    Given,
    /// The middle of the bounds: the paper's start, a void of 1 x 1 mm, says nothing of what comes after it.
    Middle,
}

/// A program that answers lines of JSON; its form is described in the user's guide.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandModel {
    /// Program and arguments; paths are relative to the study file.
    pub argv: Vec<String>,
    /// Seconds after which an evaluation counts as failed.
    pub time_limit_s: f64,
    /// Whether it gives gradients.
    pub gradient: bool,
}

impl FeModel {
    /// Whether element and size have still to be chosen for an error.
    pub fn is_unchosen(&self) -> bool {
        self.accuracy.as_ref().is_some_and(|a| a.chosen.is_none())
    }
}

impl Model {
    /// The settings of a finite-element model; `None` for a program.
    pub fn finite_elements(&self) -> Option<&FeModel> {
        match self {
            Self::FeCascade(model) | Self::FeDirect(model) => Some(model),
            Self::FeLayouts(_)
            | Self::LinearTransform(_)
            | Self::ConstantStrain(_)
            | Self::Command(_) => None,
        }
    }

    /// A reduced model with the number of its variables per actuation.
    pub fn reduced(&self) -> Option<(&ReducedModel, usize)> {
        match self {
            Self::LinearTransform(model) => Some((model, 4)),
            Self::ConstantStrain(model) => Some((model, 3)),
            Self::FeCascade(_) | Self::FeDirect(_) | Self::FeLayouts(_) | Self::Command(_) => None,
        }
    }

    /// Number of units where it is not the actuator's.
    pub fn units(&self) -> Option<usize> {
        match self {
            Self::FeCascade(model) | Self::FeDirect(model) => model.units,
            Self::FeLayouts(_) => Some(1),
            Self::LinearTransform(model) | Self::ConstantStrain(model) => model.units,
            Self::Command(_) => None,
        }
    }

    /// The same without a number of units of its own.
    #[must_use]
    pub fn without_units(&self) -> Self {
        let mut model = self.clone();
        match &mut model {
            Self::FeCascade(model) | Self::FeDirect(model) => model.units = None,
            Self::LinearTransform(model) | Self::ConstantStrain(model) => model.units = None,
            Self::FeLayouts(_) | Self::Command(_) => {}
        }
        model
    }

    /// Whether the variables describe every unit of the chain, rather than one for all.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::FeDirect(_))
    }
}

//! What is discrete and frozen about a mesh: the topology of its blocks, element counts, gradings, and the base design
//! from which the blocks' target shapes are derived. With a plan given, node positions are a smooth function of the
//! chambers' corners.
//!
//! A unit is a grid of blocks, `columns` by `rows`, with one rectangle of blocks left out for each chamber; a chamber's
//! boundary is the rim of its rectangle. So a wall has the columns (rows) between a chamber and the outline, and the
//! corner between two walls is a block of its own: at a chamber's corner three blocks share the solid angle.

mod assembly;
mod blocks;
mod chamber_order;
mod layout;
mod logical_corners;
mod profile;
mod rim;
mod size_rule;

use serde::{Deserialize, Serialize};

use super::{Actuator, InfeasibleGeometry, Point};

/// Finite elements that a plan is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanElement {
    /// Bilinear, at least three through every wall.
    Quad4,
    /// Biquadratic, at least two through every wall.
    Quad9,
}

/// A column or row of blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strip {
    /// Where its inner element lines cut it, as fractions.
    pub fractions: Vec<f64>,
    /// The width that the size rule would give it, mm.
    pub width_mm: f64,
}

impl Strip {
    /// Number of elements across the strip.
    pub fn elements(&self) -> usize {
        self.fractions.len() + 1
    }

    /// The element lines with both ends, from 0 to 1.
    pub fn lines(&self) -> impl Iterator<Item = f64> + '_ {
        std::iter::once(0.0)
            .chain(self.fractions.iter().copied())
            .chain(std::iter::once(1.0))
    }

    /// The strip cut into `elements`, graded as it was: nested where that is a multiple of its number.
    fn cut(&self, elements: usize) -> Self {
        let lines: Vec<f64> = self.lines().collect();
        let old = self.elements();
        let line = |k: usize| {
            let (i, rest) = (k * old / elements, k * old % elements);
            lines[i] + (lines[i + 1] - lines[i]) * rest as f64 / elements as f64
        };
        Self {
            fractions: (1..elements).map(line).collect(),
            width_mm: self.width_mm,
        }
    }
}

/// A place on a chamber's boundary: the fraction of an edge, which runs from corner `edge` to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Station {
    /// Edge.
    pub edge: usize,
    /// Fraction in [0, 1).
    pub fraction: f64,
}

impl Station {
    /// The place on a chamber.
    pub fn at(self, corners: &[Point]) -> Point {
        let (a, b) = (corners[self.edge], corners[(self.edge + 1) % corners.len()]);
        let f = self.fraction;
        [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])]
    }
}

/// Where a chamber sits in its unit's grid of blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChamberPlan {
    /// First and last vertex line of its columns.
    pub columns: [usize; 2],
    /// First and last vertex line of its rows.
    pub rows: [usize; 2],
    /// The places of the rim's vertices, counter-clockwise from the rim's lower left.
    pub ring: Vec<Station>,
}

/// The blocks of a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitPlan {
    /// Columns from left to right.
    pub columns: Vec<Strip>,
    /// Chambers in the unit's order.
    pub chambers: Vec<ChamberPlan>,
}

/// How fine a plan is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeshSize {
    /// By the size rule for 1 % of the tip displacement.
    #[default]
    Rule,
    /// No element edge longer than this, mm.
    Longest(f64),
    /// As many elements as squares of this side fill the solid, mm.
    Mean(f64),
}

impl From<Option<f64>> for MeshSize {
    /// A longest edge, or the rule.
    fn from(longest: Option<f64>) -> Self {
        longest.map_or(Self::Rule, Self::Longest)
    }
}

/// The frozen part of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshPlan {
    /// Element kind.
    pub element: PlanElement,
    /// The design for which the plan was made: of the targets of the block map.
    pub base: Actuator,
    /// One plan where the units are copies of each other, else one per unit.
    pub units: Vec<UnitPlan>,
    /// Rows from bottom to top, the same in every unit.
    pub rows: Vec<Strip>,
}

impl MeshPlan {
    /// Chooses a plan for a design.
    pub fn choose(
        actuator: &Actuator,
        element: PlanElement,
        size: impl Into<MeshSize>,
    ) -> Result<Self, InfeasibleGeometry> {
        layout::choose(actuator, element, size.into())
    }

    /// The plan with every element split into `factor` by `factor`; its mesh is nested in this one's.
    #[must_use]
    pub fn refined(&self, factor: usize) -> Self {
        self.cut(|elements| elements * factor.max(1))
    }

    /// The plan with other numbers of elements across its strips, each graded as it was.
    fn cut(&self, elements: impl Fn(usize) -> usize) -> Self {
        let mut plan = self.clone();
        for strip in plan
            .rows
            .iter_mut()
            .chain(plan.units.iter_mut().flat_map(|u| &mut u.columns))
        {
            *strip = strip.cut(elements(strip.elements()).max(1));
        }
        plan
    }

    /// The plan with half as many elements across every strip, rounded up.
    #[must_use]
    pub fn halved(&self) -> Self {
        self.cut(|elements| elements.div_ceil(2))
    }

    /// The plan with this share of its elements across every strip, rounded up; above 1 there are more of them.
    #[must_use]
    pub fn with_share(&self, share: f64) -> Self {
        self.cut(|elements| (elements as f64 * share).ceil() as usize)
    }

    /// Whether two plans have the same element kind, blocks and counts, so that one may stand in for the other.
    pub fn same_counts(&self, other: &Self) -> bool {
        let strips = |a: &[Strip], b: &[Strip]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.elements() == b.elements())
        };
        let ring = |a: &[Station], b: &[Station]| {
            a.len() == b.len()
                && a.iter()
                    .zip(b)
                    .all(|(a, b)| a.edge == b.edge && (a.fraction == 0.0) == (b.fraction == 0.0))
        };
        self.element == other.element
            && self.base.unit_mm == other.base.unit_mm
            && self.base.units.len() == other.base.units.len()
            && self.base.repeated == other.base.repeated
            && strips(&self.rows, &other.rows)
            && self.units.len() == other.units.len()
            && self.units.iter().zip(&other.units).all(|(a, b)| {
                strips(&a.columns, &b.columns)
                    && a.chambers.len() == b.chambers.len()
                    && a.chambers.iter().zip(&b.chambers).all(|(a, b)| {
                        a.columns == b.columns && a.rows == b.rows && ring(&a.ring, &b.ring)
                    })
            })
    }

    /// Number of elements of the whole chain.
    pub fn elements(&self) -> usize {
        let copies = if self.base.repeated {
            self.base.units.len()
        } else {
            1
        };
        let count = |strips: &[Strip]| strips.iter().map(Strip::elements).sum::<usize>();
        let unit = |unit: &UnitPlan| {
            let holes: usize = unit
                .chambers
                .iter()
                .map(|c| {
                    count(&unit.columns[c.columns[0]..c.columns[1]])
                        * count(&self.rows[c.rows[0]..c.rows[1]])
                })
                .sum();
            count(&unit.columns) * count(&self.rows) - holes
        };
        copies * self.units.iter().map(unit).sum::<usize>()
    }
}

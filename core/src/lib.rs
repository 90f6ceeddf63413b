//! The science of Salp: no async, no SQL, no sockets, no clock, no environment, no printing.
//!
//! # The problem
//!
//! A soft pneumatic actuator is a plane-strain solid with chambers. A design vector x places the corners of the chambers,
//! the corners place the nodes, X = X(x), and the channel pressures p follow a schedule: a fixed list of load states
//! k = 1..m, the same for every design, so that what is measured on them is smooth in x.
//!
//! *Energy.* With F = I + du/dX and J = det F, the displacements u at pressures p make stationary
//!
//! Pi(u; X) = int W(F) dA - sum_i p_i V_i(X + u),
//!
//! W the strain energy of the material and V_i the deformed area of the chambers of channel i, integrated exactly over the
//! elements' own edges. W = W_iso + K/2 (J - 1)^2 is nearly incompressible, so an element carries its pressure as modes of
//! its own, condensed inside it.
//!
//! *Residual.* R(u; X, p) = dPi/du = 0. Its tangent K = dR/du is symmetric, and is factorised once at every accepted state:
//! the factor serves the predictor of the next state, the count of negative pivots and the adjoint.
//!
//! *Objective.* The tip is a point fixed in space in the reference shape; over the cycle its states t_k = (a_k, b_k) are
//! the corners of a closed polygon with the area A = 1/2 sum_k (b_k + b_k+1) (a_k - a_k+1), counter-clockwise positive
//! (Eq. 3 of the paper). Minimised is -A, or +A for the other sense.
//!
//! *Constraints*, feasible when <= 0: no spike, no thin wall, and a limit on the principal stretch averaged over discs.
//!
//! *Adjoint.* For a functional Q(u_1..u_m, X) each state has its own equation with the factor that is there already,
//!
//! K_k lambda_k = -dQ/du_k,   dQ/dX = dQ/dX|_u + sum_k lambda_k . dR_k/dX,   dQ/dx = dQ/dX X'(x),
//!
//! and the last product is one transpose solve of the mesh map.
//!
//! # Notation
//!
//! | symbol | what | unit |
//! |---|---|---|
//! | x | design vector, `[x1, y1, ..., x8, y8]` | mm |
//! | X, u | reference position and displacement of a node | mm |
//! | F, J, s | deformation gradient, det F, F:F, all of the plane | 1 |
//! | W, P, A | strain energy, first Piola-Kirchhoff stress, its derivative d P/d F | MPa |
//! | mu, K | initial shear modulus, bulk modulus (K also the tangent: the text says which) | MPa |
//! | p | pressure of a channel; in an element, of the rubber | kPa in documents, MPa inside |
//! | V | deformed area of a chamber, per depth its volume | mm^2 |
//! | R, lambda | residual force per depth, adjoint displacement | N/mm, depends on Q |
//! | A | enclosed area of the tip's path | mm^2 |
//!
//! Documents carry their units in their names (`pressure_kpa`, `wall_mm`, `c10_mpa`). Forces are per mm of depth.
//!
//! # Where to start
//!
//! [`scene::read_scene`] reads one analysis, [`study::read_study`] one optimisation; both answer every fault at once. With
//! the feature `solver` (the default) [`evaluate`] is the single door: a scene or a study's request goes in, a document or
//! an outcome comes out. Without it the crate holds documents, geometry, material records and optimisers, and builds in
//! seconds: that is what the coordinator needs.
//!
//! | module | what | may import |
//! |---|---|---|
//! | [`fault`] | faults of a document with their paths | |
//! | [`actuation`] | pressures over pseudo-time, the fixed load states | |
//! | [`random`] | reproducible random numbers | |
//! | [`analysis`] | what restarts are worth: best of N with its band, expected cost to a target, profiles | random |
//! | [`geometry`] | units, chambers, cascade, validity, random designs, mesh plan and block map | random |
//! | [`reduced`] | the paper's reduced model (Eq. 1): a 2x2 transformation per unit, cascaded, fitted, explored | actuation, geometry |
//! | [`document`] | JSON values: parse, override, read | fault |
//! | [`optimiser`] | ask/tell state machines over slices of `f64` | fault |
//! | `lane` | four numbers side by side, for the kernels | |
//! | [`material`] | laws, sourced records, energy derivatives | lane |
//! | [`scene`] | one analysis as a document | actuation, document, geometry, material |
//! | [`study`] | the study document, restarts as pure state machines | random, reduced, scene, optimiser and their imports |
//! | [`hierarchy`] | which step of a study is due, what it takes, what an ended one hands on | study and its imports |
//! | `element` | shape functions, quadrature, the mixed element | lane, material |
//! | `linear` | order, analyse once, factorise, solve | lane |
//! | `mesh` | the mesher of fixed topology, Gmsh input, VTU output | element, geometry, material, scene |
//! | [`picture`] | SVG of shapes and curves | analysis, geometry, mesh, reduced |
//! | `force` | chamber pressure, tractions | mesh |
//! | `assembly` | unknowns, pattern, global residual and tangent | element, force, linear, mesh |
//! | `equilibrium` | Newton, the load path, how it ended | actuation, assembly, linear, material, mesh |
//! | `objective` | probes, enclosed area, bending angle, tip path | element, geometry, mesh |
//! | `constraint` | stretch measure, crossing walls | assembly, force, mesh |
//! | `adjoint` | derivatives with respect to nodes | assembly, equilibrium, force, objective |
//! | `evaluate` | the door | all |
//! | `verify` | published problems, extreme scenes, random designs, each with what is right | all |
//!
//! Imports go upwards in this table only; a test holds every `crate::` path against it. Symbols with their sources are in
//! `docs/NOTATION.md`.

pub mod actuation;
#[cfg(feature = "solver")]
pub mod adjoint;
pub mod analysis;
#[cfg(feature = "solver")]
pub mod assembly;
#[cfg(feature = "solver")]
pub mod constraint;
pub mod document;
#[cfg(feature = "solver")]
pub mod element;
#[cfg(feature = "solver")]
pub mod equilibrium;
#[cfg(feature = "solver")]
pub mod evaluate;
pub mod fault;
#[cfg(feature = "solver")]
pub mod force;
pub mod geometry;
pub mod hierarchy;
pub mod lane;
#[cfg(feature = "solver")]
pub mod linear;
pub mod material;
#[cfg(feature = "solver")]
pub mod mesh;
#[cfg(feature = "solver")]
pub mod objective;
pub mod optimiser;
pub mod picture;
pub mod random;
pub mod reduced;
pub mod scene;
pub mod study;
#[cfg(feature = "solver")]
pub mod verify;

#[cfg(test)]
mod import_rule;

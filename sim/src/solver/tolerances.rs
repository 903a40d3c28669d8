//! Numerical tolerances for contacts, in world units and seconds, each with its derivation or the observation behind
//! it.

// --- Rounding -----------------------------------------------------------------------------------

/// Rounding error of a coordinate, as a share of its magnitude: about `f32::EPSILON`. The velocity
/// that would close a smaller separation is too small to move a body.
pub(crate) const ROUNDING: f32 = 1.2e-7;
/// Rounding error of a velocity after a sweep, as a share of the largest one: about 8 `f32::EPSILON`.
pub(crate) const SPEED_ROUNDING: f32 = 1e-6;
/// Rounding error of the velocities of bodies at rest, as a share of the largest velocity that a single impulse would
/// give: about 4 `f32::EPSILON`. The impulses on a body under a high pile cancel only to this precision.
pub(crate) const IMPULSE_ROUNDING: f32 = 5e-7;
/// Circles whose centres are closer than this share of the radii count as concentric. Below it, the squared
/// distance loses its digits and the normal its unit length (C05).
pub(crate) const SAME_CENTER: f32 = 1e-6;
/// A path whose squared length is below this share of the squared radius counts as straight. It deviates from the
/// tangent by half of that share of the radius, which is less than rounding error.
pub(crate) const STRAIGHT: f32 = 1e-7;

// --- Overlap ------------------------------------------------------------------------------------

/// Overlap that counts as zero, a fiftieth of the default slop.
pub(crate) const OVERLAP: f32 = 1e-4;
/// Distance within which a pair has a constraint even if neither body moves. It is four times the default slop, so
/// that a resting pair never loses its constraint.
pub(crate) const SPECULATIVE: f32 = 0.02;
/// Overlap on both axes below which two boxes merely pass corner to corner. It is 1.4 times the default slop. Two
/// boxes keep the axis of the previous step until it is worse by twice as much.
pub(crate) const CORNER: f32 = 0.007;
/// The same for small boxes, as a share of the smaller one's size.
pub(crate) const CORNER_SHARE: f32 = 0.05;
/// Overlap, as a share of the thinner body's half-size, from which the normal is arbitrary, since
/// the centre of one body may lie on either side of the other's face.
pub(crate) const DEEP_SHARE: f32 = 0.5;
/// Largest overlap that is ever tolerated, as a share of the thinner body's half-size. It is half of
/// [`DEEP_SHARE`], so that the sides of the bodies can still be told apart.
pub(crate) const TOLERATED_SHARE: f32 = 0.25;
/// Share of the slop to which a larger overlap is reduced. A body that rested at exactly the slop would be
/// corrected in every step.
pub(crate) const SLOP_SHARE: f32 = 0.8;

// --- Normals and friction -----------------------------------------------------------------------

/// Cosine of the angle between old and new normal, about 45 degrees, below which an impulse is taken back. In a
/// step, the normal of a rolling contact turns by less, while a jump from the top of a box to its side turns it
/// by more.
pub(crate) const SAME_FACE: f32 = 0.7;
/// Share of the greatest friction from which a pair counts as sliding. It is the limit, allowing for rounding.
pub(crate) const SLIDING: f32 = 0.999;

// --- Convergence --------------------------------------------------------------------------------

/// Passes of the relaxation solver end when no velocity changes by more than this, units/s, and no overlap by more
/// than [`OVERLAP`].
pub(crate) const RELAXED_SPEED: f32 = 1e-3;
/// Square of the change in velocity caused by a warm start, relative to that caused by the forces on a body, beyond
/// which the impulses count as unbalanced (a factor of 8). While a pile comes to rest, they are off by a few times;
/// with a factor of 3, it comes to rest late or never.
pub(crate) const UNBALANCED: f32 = 64.0;
/// Velocity that replaces the velocity gained from gravity in a step if there is no gravity, units/s.
pub(crate) const GRAVITY_GAIN_MIN: f32 = 0.001;
/// Islands with fewer constraints are solved more precisely, by the square of the ratio, down to
/// [`SMALL_ISLAND_SHARE`] of the tolerance. This costs nothing.
pub(crate) const SMALL_ISLAND: f32 = 30.0;
/// See [`SMALL_ISLAND`].
pub(crate) const SMALL_ISLAND_SHARE: f32 = 0.001;
/// Islands with more constraints are solved more precisely, by the ratio, because the velocities that the
/// constraints of a high pile leave unsolved add up, and the pile creeps. With a tolerance four times as coarse, a
/// pile of 20,000 bodies slides for half a minute.
pub(crate) const LARGE_ISLAND: f32 = 10_000.0;
/// Number of contacts from which 16 sweeps by colour may be enough for an island that is not in motion. Smaller
/// islands are swept with forests, within `CALM_VISITS`.
pub(crate) const CALM_MIN: usize = 64;
/// Relative rounding error of an island's kinetic energy, from squares and sums of rounded velocities.
pub(crate) const ENERGY_ROUNDING: f64 = 1e-5;
/// Mass ratio beyond which an island that hardly moves is swept as a whole, and the energy of any island is guarded. A
/// heavy body that sinks into light ones and is pushed out again would gain energy.
pub(crate) const STIFF_MASS_RATIO: f32 = 1e4;
/// Maximum number of bodies for which such an island is swept until it is solved, in motion or not, if they have more
/// than three contacts each. With fewer sweeps, they would gain energy.
pub(crate) const STIFF_BODIES: usize = 40;
/// Maximum number of visits to a larger island with such masses in a step. One that does not converge would
/// take hundreds of sweeps with forests in each step without a better result.
pub(crate) const STIFF_VISITS: u32 = 32_000;
/// Number of contacts beyond which an island may count as being in motion.
pub(crate) const MOTION_MIN: usize = 16;
/// Mean sliding velocity of an island's contacts, in tolerances, beyond which its bodies count as moving past each
/// other. A pile that lands in one piece stays below it.
pub(crate) const AGITATED: f32 = 60.0;
/// The same in units/s, so that in weak gravity a heap that comes apart does not count as being in motion.
pub(crate) const AGITATED_MIN: f32 = 0.12;
/// Mean relative velocity of an island's contacts, in tolerances, below which they hardly move, so that forests pay
/// off. With 30, a heavy ball comes to rest later.
pub(crate) const SLOW: f32 = 80.0;
/// Number of moving bodies beyond which all islands are swept as a whole. When a rain of this size lands, it is full
/// of shafts and arches, and if it is not fully solved, it keeps collapsing. See `islands` for other ways in which
/// an island depends on the rest of the world.
pub(crate) const LARGE_WORLD: usize = 6000;
/// Residual of the warm start, in tolerances, below which the first sweep works without a forest.
pub(crate) const NEAR_SOLUTION: f32 = 10.0;
/// Share of the tolerance below which such a first sweep is also the last one.
pub(crate) const FIRST_SWEEP_SHARE: f32 = 0.01;
/// Share of the world's tolerance below which an island at rest is not swept at all. Changes this small are rounding
/// error, and sweeps would repeat them forever.
pub(crate) const NO_SWEEP_SHARE: f32 = 0.001;
/// Velocity, as a share of the world's tolerance, below which a body held by contacts is stopped if it is too slow to
/// change its position.
pub(crate) const REST_SHARE: f32 = 0.01;
/// Change in a displacement at which the sweeps of a position pass end, as a share of the slop.
pub(crate) const POSITION_SHARE: f32 = 0.1;
/// Lower limit on that change, world units, which applies if the slop is below ten times this.
pub(crate) const POSITION_MIN: f32 = 1e-5;
/// Share of the best factor below which stored impulses are scaled back. From 0.5 on, they cannot add energy (D >=
/// 0, see `warm_start`); with 1, every rounding error would cause scaling.
pub(crate) const WARM_START_SHARE: f32 = 0.75;
/// Tolerated downhill slope of D at a forest's solution, as a share of the slope at the start. With a smaller
/// slope, the parabola is within 1 % of its maximum there.
pub(crate) const OVERSHOOT: f32 = 0.1;
/// Share of the way to its solution from which a forest is worth the time.
pub(crate) const FOREST_SHARE_MIN: f32 = 0.5;

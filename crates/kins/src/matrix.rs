//! The Jacobian as a matrix, where people expect matrices: determinant and condition number (feature `nalgebra`).

use crate::errors::InverseError;
use crate::kinematics::{Kinematics, MAX_JOINTS};
use crate::machine::Mechanism;
use crate::maths::{fabs, sqrt};
use crate::pose::{Axis, Pose};
use nalgebra::SMatrix;

/// A square matrix of the largest machine; smaller machines fill its upper left corner.
pub type Matrix9 = SMatrix<f64, MAX_JOINTS, MAX_JOINTS>;

/// How well a machine moves at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dexterity {
    /// det ∂joints/∂pose, rows joints, columns the machine's coordinates in letter order, angles in rad.
    pub determinant: f64,
    /// Ratio of the largest to the smallest singular value, angular columns divided by a length natural to the machine (the
    /// platform's radius for Lambda and hexapod, 100 mm for the HV-Mill). Infinite at a direct singularity.
    pub condition: f64,
}

impl Mechanism {
    /// ∂joints/∂pose at `pose`: rows joints, columns the machine's coordinates in letter order; the rest of the matrix is 0.
    ///
    /// # Errors
    /// As [`Kinematics::jacobian`].
    pub fn jacobian_matrix(&self, pose: &Pose) -> Result<Matrix9, InverseError> {
        let rows = self.jacobian(pose)?;
        let mut matrix = Matrix9::zeros();
        for (r, row) in rows.iter().enumerate().take(self.joint_count()) {
            for (c, axis) in self.axes().iter().enumerate() {
                if let (Some(place), Some(entry)) = (matrix.get_mut((r, c)), row.get(axis as usize)) {
                    *place = *entry;
                }
            }
        }
        Ok(matrix)
    }

    /// Determinant and condition number of the Jacobian at `pose`. For the HV-Mill with both mechanisms: of the active one.
    ///
    /// # Errors
    /// As [`Kinematics::jacobian`].
    ///
    /// # Examples
    /// ```
    /// use pkm_kins::{Mechanism, Moma, MomaConfiguration, Pose};
    /// let moma = Mechanism::from(Moma::new(&MomaConfiguration::C.into()).unwrap());
    /// let dexterity = moma.dexterity(&Pose { x: 180.0, y: 156.0, ..Pose::ZERO }).unwrap();
    /// assert!((dexterity.determinant + 2.2).abs() < 1e-12);
    /// ```
    pub fn dexterity(&self, pose: &Pose) -> Result<Dexterity, InverseError> {
        if let Self::HvMachine(machine) = self {
            return Self::HvMill(*machine.mechanism()).dexterity(&machine.mechanism_pose(pose));
        }
        let n = self.joint_count();
        let mut matrix = self.jacobian_matrix(pose)?;
        for i in n..MAX_JOINTS {
            if let Some(place) = matrix.get_mut((i, i)) {
                *place = 1.0;
            }
        }
        let determinant = matrix.determinant();

        // For the spatial platforms angular velocity, not the rates of A B C, is what the condition is about.
        let mut scaled = match self {
            Self::Lambda6(lambda) => twist(&lambda.twist_jacobian(pose)?),
            Self::Hexapod(hexapod) => twist(&hexapod.twist_jacobian(pose)?),
            _ => self.jacobian_matrix(pose)?,
        };
        let length = match self {
            Self::Lambda6(lambda) => lambda.platform_radius_mm(),
            Self::Hexapod(hexapod) => hexapod.platform_radius_mm(),
            _ => 100.0,
        };
        for (c, axis) in self.axes().iter().enumerate() {
            if axis.is_rotary() {
                for r in 0..n {
                    if let Some(entry) = scaled.get_mut((r, c)) {
                        // A rotary joint's own row is rad per rad.
                        *entry /= if self.joint_kind(r) == crate::JointKind::Rotary { 1.0 } else { length };
                    }
                }
            }
        }
        // Fill the diagonal with the root mean square of the singular values: it lies between the ends that are wanted.
        let fill = sqrt(scaled.norm_squared() / n as f64);
        for i in n..MAX_JOINTS {
            if let Some(place) = scaled.get_mut((i, i)) {
                *place = fill;
            }
        }
        let (mut low, mut high) = (f64::MAX, 0.0_f64);
        if let Some(svd) = nalgebra::linalg::SVD::try_new(scaled, false, false, 1e-15, 1000) {
            for value in svd.singular_values.iter() {
                low = low.min(fabs(*value));
                high = high.max(fabs(*value));
            }
        }
        let condition = if low > 0.0 && low < f64::MAX { high / low } else { f64::INFINITY };
        Ok(Dexterity { determinant, condition })
    }
}

fn twist(rows: &[[f64; 6]; 6]) -> Matrix9 {
    let mut matrix = Matrix9::zeros();
    for (r, row) in rows.iter().enumerate() {
        for (c, entry) in row.iter().enumerate() {
            if let Some(place) = matrix.get_mut((r, c)) {
                *place = *entry;
            }
        }
    }
    matrix
}

/// The six columns of a twist are those of X Y Z A B C.
const _: () = assert!(Axis::C as usize == 5);

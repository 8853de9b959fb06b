//! Isotropic laws as the matrix of fibres, and back.

use super::Law;
use super::fibred::Matrix;

impl TryFrom<Law> for Matrix {
    type Error = String;

    fn try_from(law: Law) -> Result<Self, String> {
        match law {
            Law::NeoHookean(law) => Ok(Self::NeoHookean(law)),
            Law::MooneyRivlin(law) => Ok(Self::MooneyRivlin(law)),
            Law::Ogden(law) => Ok(Self::Ogden(law)),
            Law::Yeoh(law) => Ok(Self::Yeoh(law)),
            Law::VerondaWestmann(law) => Ok(Self::VerondaWestmann(law)),
            Law::Fibred(_) => Err("the matrix of fibres has fibres: use an isotropic law".into()),
        }
    }
}

impl From<Matrix> for Law {
    fn from(matrix: Matrix) -> Self {
        match matrix {
            Matrix::NeoHookean(law) => Self::NeoHookean(law),
            Matrix::MooneyRivlin(law) => Self::MooneyRivlin(law),
            Matrix::Ogden(law) => Self::Ogden(law),
            Matrix::Yeoh(law) => Self::Yeoh(law),
            Matrix::VerondaWestmann(law) => Self::VerondaWestmann(law),
        }
    }
}

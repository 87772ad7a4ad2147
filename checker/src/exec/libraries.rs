//! Libraries that models import: where they may come from, and calls of their functions.
//!
//! Invariants:
//! * A library is loaded only if the user names it, or a folder that holds it. The path that a
//!   model gives is a name: nothing is loaded from there unless the user names that place too.
//! * A library that is loaded stays so until the process ends, since compiled code may call it.
//! * Calls of functions of libraries follow each other: no two of them run at the same time.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};

use crate::ir::{ExternalId, ExternalSignature, RunTimeErrorKind};

use super::external_words::{ExternalWords, LibraryError};
#[cfg(feature = "jit")]
use super::jit::external;

/// The files and folders that libraries may be loaded from.
#[derive(Clone, Debug, Default)]
pub struct Libraries {
    allowed: Vec<PathBuf>,
}

impl Libraries {
    /// Those in these files and folders.
    pub fn new(allowed: Vec<PathBuf>) -> Libraries {
        Libraries { allowed }
    }

    /// The files and folders.
    pub fn allowed(&self) -> &[PathBuf] {
        &self.allowed
    }

    /// The file of the library that a model names so: an allowed file with that file name, or one
    /// in an allowed folder. The name may lack what the system puts around it, as in `libNAME.so`.
    pub fn find(&self, name: &str) -> Option<PathBuf> {
        let bare = name
            .rsplit(['/', '\\'])
            .next()
            .filter(|bare| !bare.is_empty())?;
        let names = [
            bare.to_owned(),
            format!("{bare}{DLL_SUFFIX}"),
            format!("{DLL_PREFIX}{bare}{DLL_SUFFIX}"),
        ];
        self.allowed.iter().find_map(|allowed| {
            if allowed.is_dir() {
                let mut files = names.iter().map(|name| allowed.join(name));
                return files.find(|file| file.is_file());
            }
            let is_it = |name: &String| allowed.file_name().is_some_and(|own| own == name.as_str());
            names.iter().any(is_it).then(|| allowed.clone())
        })
    }

    /// A function of a library, which is loaded if it is not yet.
    ///
    /// # Errors
    /// The library cannot be loaded, or has no such function.
    #[cfg(feature = "jit")]
    pub fn function(
        path: &Path,
        symbol: &str,
        signature: &ExternalSignature,
    ) -> Result<ExternalId, LibraryError> {
        external::function(path, symbol, signature)
    }

    /// The same in an engine without a compiler, which cannot call any.
    ///
    /// # Errors
    /// Always.
    #[cfg(not(feature = "jit"))]
    pub fn function(
        _path: &Path,
        _symbol: &str,
        _signature: &ExternalSignature,
    ) -> Result<ExternalId, LibraryError> {
        let cause = "this build of the engine has no compiler, which makes the calls";
        Err(LibraryError::NotCallable(cause.to_owned()))
    }
}

/// The type of a function, if there is one with this number.
pub(super) fn signature_of(id: ExternalId) -> Option<&'static ExternalSignature> {
    #[cfg(feature = "jit")]
    return external::by_id(id).map(external::External::signature);
    #[cfg(not(feature = "jit"))]
    {
        let _ = id;
        None
    }
}

/// Calls a function: of each parameter its value (the bits of a double), or the words behind it,
/// which are changed in place. Returns the value in the same way.
///
/// # Errors
/// It leaves an integer out of its range.
pub(super) fn call(
    id: ExternalId,
    arguments: &mut [ExternalWords],
) -> Result<u64, RunTimeErrorKind> {
    #[cfg(feature = "jit")]
    if let Some(external) = external::by_id(id) {
        return external.call(arguments);
    }
    let _ = (id, arguments);
    Err(RunTimeErrorKind::NotLoaded)
}

/// Calls a function without parameters and result, such as a hook of a library.
pub fn call_hook(hook: ExternalId) {
    // Without parameters and a result nothing can be out of range.
    let _ = call(hook, &mut []);
}

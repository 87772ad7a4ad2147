//! Functions of libraries: loading them, and code that calls them with their exact C types.
//!
//! For each function there is a *trampoline*, compiled once: it takes the arguments from 64-bit
//! words, calls the function as C code would, and leaves the result in a word. The interpreter and
//! compiled code both call it through [`External::call`], so that they cannot differ.
//!
//! Invariants:
//! * Libraries, trampolines and [`External`]s live until the process ends: compiled code keeps
//!   their addresses.
//! * What is behind a pointer is a copy with the alignment that C wants. It is checked before it is
//!   written back.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};
use std::time::SystemTime;

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F64, I8, I32, I64};
use cranelift_codegen::ir::{AbiParam, InstBuilder, MemFlagsData, Signature, UserFuncName};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{Module, default_libcall_names};
use libloading::Library;

use crate::exec::arithmetic::{double_of_words, double_words};
use crate::exec::external_words::{ExternalWords, LibraryError};
use crate::ir::{ExternalId, ExternalParameter, ExternalSignature, ExternalType, RunTimeErrorKind};

/// Takes the addresses of the arguments and of the result.
type Trampoline = unsafe extern "C" fn(*const u64, *mut u64);

/// A function of a library, ready to be called.
#[derive(Debug)]
pub(in crate::exec) struct External {
    signature: ExternalSignature,
    trampoline: Trampoline,
}

/// The functions, by their numbers.
static FUNCTIONS: RwLock<Vec<&'static External>> = RwLock::new(Vec::new());

/// What is loaded, and the code of the trampolines.
static LOADED: Mutex<Option<Loaded>> = Mutex::new(None);

/// Held during calls: libraries need not stand several at a time.
static CALLING: Mutex<()> = Mutex::new(());

/// The hook of a library that is run when it is loaded.
const CONSTRUCT: &str = "__ON_CONSTRUCT__";

#[derive(Default)]
struct Loaded {
    libraries: HashMap<PathBuf, (&'static Library, Stamp)>,
    functions: HashMap<(PathBuf, String, ExternalSignature), ExternalId>,
}

fn locked<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What tells whether a file is still the same.
type Stamp = (u64, Option<SystemTime>);

fn stamp(path: &Path) -> Stamp {
    fs::metadata(path).map_or((0, None), |data| (data.len(), data.modified().ok()))
}

/// The function with this number.
pub(in crate::exec) fn by_id(ExternalId(number): ExternalId) -> Option<&'static External> {
    let functions = FUNCTIONS.read();
    let functions = functions.unwrap_or_else(PoisonError::into_inner);
    functions.get(number as usize).copied()
}

/// A function of the library in a file, which is loaded if it is not yet.
pub(in crate::exec) fn function(
    path: &Path,
    symbol: &str,
    signature: &ExternalSignature,
) -> Result<ExternalId, LibraryError> {
    let path = path.canonicalize();
    let path = path.map_err(|error| LibraryError::NotLoaded(error.to_string()))?;
    let mut loaded = locked(&LOADED);
    let loaded = loaded.get_or_insert_default();
    let library = loaded.library(&path)?;
    let key = (path, symbol.to_owned(), signature.clone());
    if let Some(&known) = loaded.functions.get(&key) {
        return Ok(known);
    }
    let code = address_of(library, symbol).ok_or(LibraryError::NoSymbol)?;
    let id = add(code, signature)?;
    loaded.functions.insert(key, id);
    Ok(id)
}

impl Loaded {
    /// The library in a file. Its hook is run when it is loaded.
    fn library(&mut self, path: &Path) -> Result<&'static Library, LibraryError> {
        let stamp = stamp(path);
        if let Some(&(library, known)) = self.libraries.get(path) {
            return if known == stamp {
                Ok(library)
            } else {
                Err(LibraryError::Changed)
            };
        }
        let library = load(path)?;
        let library: &'static Library = Box::leak(Box::new(library));
        self.libraries.insert(path.to_owned(), (library, stamp));
        if let Some(code) = address_of(library, CONSTRUCT) {
            let hook = add(code, &ExternalSignature::default())?;
            if let Some(hook) = by_id(hook) {
                // Without parameters and a result nothing can be out of range.
                let _ = hook.call(&mut []);
            }
        }
        Ok(library)
    }
}

#[expect(unsafe_code, reason = "loading a library runs its initialisers")]
fn load(path: &Path) -> Result<Library, LibraryError> {
    // SAFETY: the user has allowed to run the code of this library. That it does not harm this
    // process cannot be checked; the documentation says so.
    let library = unsafe { Library::new(path) };
    library.map_err(|error| LibraryError::NotLoaded(error.to_string()))
}

/// The address of a function of a library.
#[expect(unsafe_code, reason = "the address of a symbol has no type")]
fn address_of(library: &Library, symbol: &str) -> Option<usize> {
    // SAFETY: the address is only taken here; it is called with the types that the model declares,
    // which the user vouches for.
    let found = unsafe { library.get::<*const u8>(symbol.as_bytes()) }.ok()?;
    let address = *found as usize;
    (address != 0).then_some(address)
}

/// Makes the trampoline of a function and gives it a number.
fn add(code: usize, signature: &ExternalSignature) -> Result<ExternalId, LibraryError> {
    let trampoline = trampoline(code, signature).map_err(LibraryError::NotCallable)?;
    let external: &'static External = Box::leak(Box::new(External {
        signature: signature.clone(),
        trampoline,
    }));
    let functions = FUNCTIONS.write();
    let mut functions = functions.unwrap_or_else(PoisonError::into_inner);
    functions.push(external);
    Ok(ExternalId(functions.len() as u32 - 1))
}

/// The type of a value in native code, and how it fills a register.
fn native(kind: ExternalType) -> AbiParam {
    match kind {
        ExternalType::Integer => AbiParam::new(I32).sext(),
        ExternalType::Bool => AbiParam::new(I8).uext(),
        ExternalType::Double => AbiParam::new(F64),
    }
}

/// Compiles the trampoline of the function at an address.
fn trampoline(code: usize, signature: &ExternalSignature) -> Result<Trampoline, String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let mut flags = settings::builder();
    flags.set("is_pic", "false").map_err(|error| text(&error))?;
    let isa = cranelift_native::builder()
        .map_err(text_of)?
        .finish(settings::Flags::new(flags))
        .map_err(|error| text(&error))?;
    let convention = isa.default_call_conv();
    let mut module = JITModule::new(JITBuilder::with_isa(isa, default_libcall_names()));
    let mut context = module.make_context();
    let mut builder_context = FunctionBuilderContext::new();
    let mut own = Signature::new(convention);
    own.params = vec![AbiParam::new(I64); 2];
    let id = module
        .declare_anonymous_function(&own)
        .map_err(|error| text(&error))?;
    context.func.signature = own;
    context.func.name = UserFuncName::user(0, id.as_u32());
    let mut builder = FunctionBuilder::new(&mut context.func, &mut builder_context);
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    let (source, target) = (
        builder.block_params(block)[0],
        builder.block_params(block)[1],
    );
    let mut called = Signature::new(convention);
    let mut arguments = Vec::new();
    let flags = MemFlagsData::trusted();
    for (number, parameter) in signature.parameters.iter().enumerate() {
        let kind = match parameter {
            ExternalParameter::Value(kind) => native(*kind),
            ExternalParameter::Pointer { .. } | ExternalParameter::Text => AbiParam::new(I64),
        };
        called.params.push(kind);
        let offset = 8 * number as i32;
        arguments.push(builder.ins().load(kind.value_type, flags, source, offset));
    }
    called.returns = signature.result.map(native).into_iter().collect();
    let called = builder.import_signature(called);
    let code = builder.ins().iconst(I64, code as i64);
    let call = builder.ins().call_indirect(called, code, &arguments);
    if let Some(kind) = signature.result {
        let value = builder.inst_results(call)[0];
        let value = match kind {
            ExternalType::Integer => builder.ins().uextend(I64, value),
            ExternalType::Double => value,
            ExternalType::Bool => {
                let holds = builder.ins().icmp_imm_u(IntCC::NotEqual, value, 0);
                builder.ins().uextend(I64, holds)
            }
        };
        builder.ins().store(flags, value, target, 0);
    }
    builder.ins().return_(&[]);
    builder.seal_all_blocks();
    builder.finalize(module.target_config());
    module
        .define_function(id, &mut context)
        .map_err(|error| text(&error))?;
    module
        .finalize_definitions()
        .map_err(|error| text(&error))?;
    let address = module.get_finalized_function(id);
    // The code is needed until the process ends.
    std::mem::forget(module);
    Ok(as_trampoline(address))
}

fn text_of(error: &str) -> String {
    error.to_owned()
}

#[expect(unsafe_code, reason = "compiled code is called by its address")]
fn as_trampoline(address: *const u8) -> Trampoline {
    // SAFETY: the code was just compiled with this signature, and is never freed.
    unsafe { std::mem::transmute::<*const u8, Trampoline>(address) }
}

/// What is behind a pointer while a function runs.
enum Copied {
    Words(Vec<i32>),
    Bytes(Vec<u8>),
    Doubles(Vec<f64>),
}

impl Copied {
    /// The values that lie in these words.
    fn of(words: &[i32], of: ExternalType, stride: u32) -> Copied {
        let parts = words.chunks_exact(stride.max(1) as usize);
        match of {
            ExternalType::Integer => Copied::Words(parts.map(|part| part[0]).collect()),
            ExternalType::Bool => Copied::Bytes(parts.map(|part| (part[0] != 0).into()).collect()),
            ExternalType::Double => Copied::Doubles(
                parts
                    .map(|part| double_of_words(part[0], part[1]))
                    .collect(),
            ),
        }
    }

    fn address(&mut self) -> u64 {
        match self {
            Copied::Words(words) => words.as_mut_ptr() as u64,
            Copied::Bytes(bytes) => bytes.as_mut_ptr() as u64,
            Copied::Doubles(doubles) => doubles.as_mut_ptr() as u64,
        }
    }

    /// Writes the values back.
    fn write(
        &self,
        words: &mut [i32],
        stride: u32,
        low: i32,
        high: i32,
    ) -> Result<(), RunTimeErrorKind> {
        let parts = words.chunks_exact_mut(stride.max(1) as usize);
        match self {
            Copied::Words(values) => {
                if values.iter().any(|value| !(low..=high).contains(value)) {
                    return Err(RunTimeErrorKind::OutOfRange);
                }
                parts.zip(values).for_each(|(part, &value)| part[0] = value);
            }
            Copied::Bytes(values) => {
                parts
                    .zip(values)
                    .for_each(|(part, &value)| part[0] = (value != 0).into());
            }
            Copied::Doubles(values) => {
                parts
                    .zip(values)
                    .for_each(|(part, &value)| part[..2].copy_from_slice(&double_words(value)));
            }
        }
        Ok(())
    }
}

impl External {
    /// Its type.
    pub(in crate::exec) fn signature(&self) -> &ExternalSignature {
        &self.signature
    }

    /// Calls it: see [`crate::exec::libraries::call`].
    pub(in crate::exec) fn call(
        &self,
        arguments: &mut [ExternalWords],
    ) -> Result<u64, RunTimeErrorKind> {
        assert_eq!(
            arguments.len(),
            self.signature.parameters.len(),
            "the arguments are those of the signature"
        );
        let mut copies: Vec<Option<Copied>> = Vec::with_capacity(arguments.len());
        let mut words = Vec::with_capacity(arguments.len());
        for (argument, parameter) in arguments.iter_mut().zip(&self.signature.parameters) {
            match (argument, parameter) {
                (ExternalWords::Value(value), ExternalParameter::Value(_)) => {
                    words.push(*value);
                    copies.push(None);
                }
                (ExternalWords::Memory(memory), parameter) => {
                    let mut copied = match *parameter {
                        ExternalParameter::Pointer {
                            of, length, stride, ..
                        } => {
                            assert_eq!(
                                memory.len(),
                                (length * stride) as usize,
                                "as many words as the signature says"
                            );
                            Copied::of(memory, of, stride)
                        }
                        _ => Copied::Words(memory.clone()),
                    };
                    words.push(copied.address());
                    copies.push(Some(copied));
                }
                _ => unreachable!("a value for a value, and memory for a pointer"),
            }
        }
        let result = self.run(&words);
        let parameters = self.signature.parameters.iter();
        for ((argument, parameter), copied) in arguments.iter_mut().zip(parameters).zip(&copies) {
            if let ExternalParameter::Pointer {
                stride,
                written: Some(range),
                ..
            } = parameter
                && let ExternalWords::Memory(memory) = argument
                && let Some(copied) = copied
            {
                copied.write(memory, *stride, range.0, range.1)?;
            }
        }
        Ok(result)
    }

    #[expect(unsafe_code, reason = "a function of a library is called")]
    fn run(&self, words: &[u64]) -> u64 {
        let calling = locked(&CALLING);
        let mut result = 0;
        // SAFETY: the trampoline reads as many words as the signature has parameters, which the
        // caller has checked; pointers among them lead to copies that live through the call and
        // have the length of the signature. That the function keeps to its type is the word of the
        // model, and of the user who has allowed the library.
        unsafe { (self.trampoline)(words.as_ptr(), &raw mut result) };
        drop(calling);
        result
    }
}

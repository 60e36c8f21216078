//! Everything unsafe: LinuxCNC's HAL as the modules use it, and the symbols that LinuxCNC looks up in a module.
//!
//! LinuxCNC's contract, on which every `unsafe` here rests:
//! * `rtapi_app_main` is called once, before any other function of the module and before the real-time threads run;
//! * `kinematics*` are called by one real-time thread (`motmod`), with pointers to an `EmcPose` (nine f64) and to joint arrays of
//!   `EMCMOT_MAX_JOINTS` (16) f64, which nothing else uses during the call;
//! * memory of `hal_malloc` is shared, zeroed, aligned to 8 bytes for sizes of 8 and more, and mapped as long as the module.
#![allow(unsafe_code)] // the one file that may

use crate::mechanism::Mechanism;
use crate::message::Message;
use crate::module::{GROUP, MOST_GROUPS, State};
use core::cell::UnsafeCell;
use core::ffi::{CStr, c_char, c_int, c_long, c_ulong, c_void};
use core::sync::atomic::AtomicU64;
use pkm_kins::{Joints, Name, Named, Pose, Slot};

// Only functions with fixed arguments create HAL names (the `...newf` ones are variadic, which a test in Rust cannot stand in for).
unsafe extern "C" {
    fn hal_init(name: *const c_char) -> c_int;
    fn hal_ready(id: c_int) -> c_int;
    fn hal_exit(id: c_int) -> c_int;
    fn hal_malloc(size: c_long) -> *mut c_void;
    fn hal_param_float_new(name: *const c_char, dir: c_int, place: *mut f64, id: c_int) -> c_int;
    fn hal_param_s32_new(name: *const c_char, dir: c_int, place: *mut i32, id: c_int) -> c_int;
    fn hal_param_bit_new(name: *const c_char, dir: c_int, place: *mut bool, id: c_int) -> c_int;
    fn hal_pin_u32_new(name: *const c_char, dir: c_int, place: *mut *mut u32, id: c_int) -> c_int;
    fn rtapi_print_msg(level: c_int, format: *const c_char, ...);
    safe fn rtapi_get_time() -> i64;
}

/// `hal.h`: a pin that the component writes; a parameter that `setp` may write.
const HAL_OUT: c_int = 32;
const HAL_RW: c_int = 192;
/// `rtapi.h`
const RTAPI_MSG_ERR: c_int = 1;
/// `errno.h`
const EINVAL: c_int = 22;
const ENOMEM: c_int = 12;
/// `kinematics.h`
const KINEMATICS_BOTH: c_int = 4;

/// LinuxCNC's clock, ns.
pub(crate) fn now_ns() -> i64 {
    rtapi_get_time()
}

/// A HAL pin that the module writes: HAL moves the pointer when the pin is linked to a signal.
pub(crate) struct OutPin(*const *mut u32);

impl OutPin {
    #[inline(always)]
    pub(crate) fn set(&self, value: u32) {
        // SAFETY: `hal_pin_u32_new` has put a valid pointer into this place of HAL memory, or the pin was never made.
        unsafe {
            if !self.0.is_null() {
                (*self.0).write_volatile(value);
            }
        }
    }
}

/// The module's side of HAL.
pub(crate) struct Hal {
    /// The parameters, one word each, in groups; the last group is filled up with words that never change.
    pub(crate) groups: &'static [[AtomicU64; GROUP]],
    pub(crate) errors: OutPin,
    pub(crate) last_iterations: OutPin,
    pub(crate) max_iterations: OutPin,
    name: &'static CStr,
}

impl Hal {
    pub(crate) fn print(&self, message: &Message) {
        print(self.name, message);
    }
}

fn print(name: &CStr, message: &Message) {
    let name = name.as_ptr();
    // SAFETY: every format in `message` takes the arguments of its kind, in this order, and only simple
    // conversions: motmod's message handler has its own reader of formats, and `%.*s` makes it crash.
    unsafe {
        match *message {
            Message::Plain(format, a, b) => rtapi_print_msg(RTAPI_MSG_ERR, format.as_ptr(), name, a, b),
            Message::Joint(format, joint, a, b) => {
                rtapi_print_msg(RTAPI_MSG_ERR, format.as_ptr(), name, joint, a, b);
            }
            Message::Named(format, text, a, b) => {
                let text = HalName::text(text);
                rtapi_print_msg(RTAPI_MSG_ERR, format.as_ptr(), name, text.as_ptr(), a, b);
            }
        }
    }
}

/// A name that ends in 0; of HAL: `prefix.part.quantity`.
struct HalName([u8; 48]);

impl HalName {
    fn new(prefix: &str, name: Name) -> Self {
        let dot = if name.part.is_empty() { "" } else { "." };
        Self::of(&[prefix, ".", name.part, dot, name.quantity])
    }

    /// One text, cut where it is too long.
    fn text(text: &str) -> Self {
        Self::of(&[text])
    }

    fn of(texts: &[&str]) -> Self {
        let mut bytes = [0; 48];
        let text = texts.iter().flat_map(|text| text.bytes());
        // The last byte stays 0.
        for (place, byte) in bytes.iter_mut().take(47).zip(text) {
            *place = byte;
        }
        Self(bytes)
    }

    fn as_ptr(&self) -> *const c_char {
        self.0.as_ptr().cast()
    }
}

/// A module: its state, behind the functions LinuxCNC calls.
pub struct Module<M: Mechanism> {
    name: &'static CStr,
    id: UnsafeCell<c_int>,
    state: UnsafeCell<State<M>>,
}

// SAFETY: by LinuxCNC's contract above, one thread at a time calls the functions.
unsafe impl<M: Mechanism> Sync for Module<M> {}

impl<M: Mechanism> Module<M> {
    /// Before `loadrt`. `name` is the file's name without `.so`: `loadrt` looks for a component of that name.
    pub const fn new(name: &'static CStr) -> Self {
        Self { name, id: UnsafeCell::new(-1), state: UnsafeCell::new(State::new()) }
    }

    /// `rtapi_app_main`: makes the HAL component. Returns 0 or a negative errno.
    ///
    /// # Safety
    /// LinuxCNC's contract; `machine` is NULL or ends in 0.
    pub unsafe fn load(&self, machine: *const c_char) -> c_int {
        // SAFETY: as promised by the caller.
        let machine = if machine.is_null() { c"" } else { unsafe { CStr::from_ptr(machine) } };
        let Some(parameters) = State::<M>::start(machine.to_bytes()) else {
            print(
                self.name,
                &Message::Plain(
                    c"%s: no machine of the name given by machine= ships with this module\n",
                    0.0,
                    0.0,
                ),
            );
            return -EINVAL;
        };
        // SAFETY: the contract; nothing else runs yet.
        unsafe {
            let id = hal_init(self.name.as_ptr());
            if id < 0 {
                return id;
            }
            self.id.get().write(id);
            let made = self.make(id, parameters);
            let ready = match made {
                Ok(hal) => {
                    (*self.state.get()).load(hal);
                    hal_ready(id)
                }
                Err(errno) => errno,
            };
            if ready < 0 {
                hal_exit(id);
            }
            ready
        }
    }

    /// Makes parameters and pins.
    unsafe fn make(&self, id: c_int, mut parameters: M::Parameters) -> Result<Hal, c_int> {
        let mut count: usize = 0;
        parameters.visit(&mut |_, _| count = usize::wrapping_add(count, 1));
        let groups = usize::div_ceil(count, GROUP).min(MOST_GROUPS);
        // SAFETY: `hal_malloc` gives zeroed memory that lives as long as the module; every place given to HAL lies in it.
        unsafe {
            let words = hal_malloc(size_of::<[AtomicU64; GROUP]>().saturating_mul(groups) as c_long)
                .cast::<AtomicU64>();
            let pins = hal_malloc((3 * size_of::<*mut u32>()) as c_long).cast::<*mut u32>();
            if words.is_null() || pins.is_null() || !words.is_aligned() || !pins.is_aligned() {
                return Err(-ENOMEM);
            }
            let mut result = 0;
            let mut index = 0;
            parameters.visit(&mut |name, slot| {
                if result < 0 || index == groups.saturating_mul(GROUP) {
                    return;
                }
                let place = words.add(index).cast::<c_void>();
                index = usize::wrapping_add(index, 1);
                let name = HalName::new(M::PREFIX, name);
                result = match slot {
                    Slot::Number(number) => {
                        place.cast::<f64>().write_volatile(*number);
                        hal_param_float_new(name.as_ptr(), HAL_RW, place.cast(), id)
                    }
                    Slot::Integer(integer) => {
                        place.cast::<i32>().write_volatile(i32::from(*integer));
                        hal_param_s32_new(name.as_ptr(), HAL_RW, place.cast(), id)
                    }
                    Slot::Flag(flag) => {
                        place.cast::<bool>().write_volatile(*flag);
                        hal_param_bit_new(name.as_ptr(), HAL_RW, place.cast(), id)
                    }
                };
            });
            let pin = |index: usize, quantity, result: &mut c_int| {
                let place = pins.add(index);
                if *result >= 0 {
                    let name = HalName::new(M::PREFIX, Name { part: "", quantity });
                    *result = hal_pin_u32_new(name.as_ptr(), HAL_OUT, place, id);
                }
                OutPin(place)
            };
            let none = || OutPin(core::ptr::null());
            let errors = pin(0, "errors", &mut result);
            let (last_iterations, max_iterations) = if M::ITERATES {
                (pin(1, "last-iterations", &mut result), pin(2, "max-iterations", &mut result))
            } else {
                (none(), none())
            };
            if result < 0 {
                return Err(result);
            }
            let groups = core::slice::from_raw_parts(words.cast(), groups);
            Ok(Hal { groups, errors, last_iterations, max_iterations, name: self.name })
        }
    }

    /// `rtapi_app_exit`
    ///
    /// # Safety
    /// LinuxCNC's contract.
    pub unsafe fn unload(&self) {
        // SAFETY: the contract.
        unsafe {
            *self.state.get() = State::new();
            hal_exit(self.id.get().read());
        }
    }

    /// `kinematicsInverse`
    ///
    /// # Safety
    /// LinuxCNC's contract.
    #[inline(always)]
    pub unsafe fn inverse(&self, pose: *const Pose, joints: *mut f64) -> c_int {
        // SAFETY: the contract; `Pose` is laid out as `EmcPose`, nine of the sixteen joints are used.
        unsafe { (*self.state.get()).inverse(&*pose, &mut *joints.cast::<Joints>()) }
    }

    /// `kinematicsForward`
    ///
    /// # Safety
    /// LinuxCNC's contract.
    #[inline(always)]
    pub unsafe fn forward(&self, joints: *const f64, pose: *mut Pose) -> c_int {
        // SAFETY: as above.
        unsafe { (*self.state.get()).forward(&*joints.cast::<Joints>(), &mut *pose) }
    }

    /// `kinematicsSwitch`
    ///
    /// # Safety
    /// LinuxCNC's contract.
    pub unsafe fn switch(&self, to: c_int) -> c_int {
        // SAFETY: the contract.
        unsafe { (*self.state.get()).switch(to) }
    }

    /// `kinematicsType`
    pub fn kinematics_type(&self) -> c_int {
        KINEMATICS_BOTH
    }

    /// `kinematicsSwitchable`
    pub fn switchable(&self) -> c_int {
        c_int::from(M::TYPES > 1)
    }
}

/// A string that LinuxCNC may set before `rtapi_app_main`: `loadrt moma_kins machine=moma-a`.
pub struct StringParameter(UnsafeCell<*const c_char>);

// SAFETY: written by LinuxCNC before the module runs, read by `rtapi_app_main`.
unsafe impl Sync for StringParameter {}

impl StringParameter {
    /// Not set.
    pub const fn unset() -> Self {
        Self(UnsafeCell::new(core::ptr::null()))
    }

    /// What LinuxCNC has put there.
    pub fn get(&self) -> *const c_char {
        // SAFETY: LinuxCNC has finished writing.
        unsafe { self.0.get().read() }
    }

    /// Where LinuxCNC writes.
    pub const fn address(&'static self) -> Symbol {
        Symbol(self.0.get().cast_const().cast())
    }
}

/// An exported pointer.
#[repr(transparent)]
pub struct Symbol(*const c_void);

// SAFETY: the pointer never changes, and what it points to is synchronised by its owner.
unsafe impl Sync for Symbol {}

impl Symbol {
    /// A text.
    pub const fn text(text: &'static CStr) -> Self {
        Self(text.as_ptr().cast())
    }
}

/// Unused arguments of the kinematics: LinuxCNC's flags (how it chooses branches in some modules; here a branch is geometry).
pub type Flags = c_ulong;

/// Makes a module: `module!("moma_kins", Moma)`.
#[macro_export]
macro_rules! module {
    ($name:literal, $mechanism:ty) => {
        #[allow(unsafe_code, non_upper_case_globals, missing_docs, unreachable_pub)]
        mod exported {
            use core::ffi::{CStr, c_int};
            use $crate::ffi::{Flags, Module, StringParameter, Symbol};
            use $crate::pkm_kins::Pose;

            const NAME: &CStr = match CStr::from_bytes_with_nul(concat!($name, "\0").as_bytes()) {
                Ok(name) => name,
                Err(_) => panic!("a name has no NUL"),
            };
            static MODULE: Module<$mechanism> = Module::new(NAME);
            static MACHINE: StringParameter = StringParameter::unset();

            #[unsafe(no_mangle)]
            pub static rtapi_info_address_machine: Symbol = MACHINE.address();
            #[unsafe(no_mangle)]
            pub static rtapi_info_type_machine: Symbol = Symbol::text(c"s");
            #[unsafe(no_mangle)]
            pub static rtapi_info_description_machine: Symbol = Symbol::text(
                c"start with the geometry of a shipped machine; without it every number must be set by setp",
            );
            #[unsafe(no_mangle)]
            pub static rtapi_info_license: Symbol = Symbol::text(c"GPL");

            // SAFETY of all: LinuxCNC calls them by the contract that `ffi` states.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn rtapi_app_main() -> c_int {
                unsafe { MODULE.load(MACHINE.get()) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn rtapi_app_exit() {
                unsafe { MODULE.unload() }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn kinematicsInverse(
                pose: *const Pose,
                joints: *mut f64,
                _: *const Flags,
                _: *mut Flags,
            ) -> c_int {
                unsafe { MODULE.inverse(pose, joints) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn kinematicsForward(
                joints: *const f64,
                pose: *mut Pose,
                _: *const Flags,
                _: *mut Flags,
            ) -> c_int {
                unsafe { MODULE.forward(joints, pose) }
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn kinematicsType() -> c_int {
                MODULE.kinematics_type()
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn kinematicsSwitchable() -> c_int {
                MODULE.switchable()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn kinematicsSwitch(to: c_int) -> c_int {
                unsafe { MODULE.switch(to) }
            }
        }
    };
}

/// Never called: the proof is that the symbol below exists nowhere. A module in which a panic was linked refers to it, and
/// then neither `rtapi_app` nor the test can load it.
#[cfg(panic = "abort")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        safe fn a_panic_was_linked_into_this_pkm_module() -> !;
    }
    a_panic_was_linked_into_this_pkm_module()
}

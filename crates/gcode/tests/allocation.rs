//! Nothing is allocated per block: a program of any length is interpreted in the memory that its first rounds took.

use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Interpreter, MemorySource, Settings, Status, ToolTable};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

std::thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts by thread.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged; counting touches a constant-initialised thread local only.
#[allow(unsafe_code)] // there is no other way to see an allocation
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as required of our caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as required of our caller.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as required of our caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

struct Nothing;

impl CanonSink for Nothing {
    fn command(&mut self, _: &Canon<'_>, _: Span) {}
}

/// Every kind of block that a long program repeats.
const PROGRAM: &str = "\
#<n> = 0 #31 = 1
o<s> sub
  #<local> = [#1 + 1]
  G1 X[#<local> * SIN[30]] (a remark)
o<s> endsub [#<local>]
F100 S500 M3
G81 X1 Y1 Z-1 R1
G80
o1 while [#<n> lt 400]
  #<n> = [#<n> + 1]
  G0 X1 Y2 Z#<n>
  G1 X[SQRT[ABS[#31]] + 2 ** 3] F200
  G2 I1
  G1 X3 Y2
  o<s> call [#<n>]
  o2 if [#<n> mod 2]
    G81 X1 Y1 Z-1 R1
    G80
  o2 else
    G43.1 Z1
    G49
    G55
    G54
  o2 endif
  o3 repeat [3]
    G91 G0 X0.1
    G90
  o3 endrepeat
  o4 do
    #31 = [#31 + 1]
  o4 while [#31 mod 4 ne 0]
  M8
  M9
  (print,#<n> %d #31)
o1 endwhile
M2
";

#[test]
fn no_block_allocates_in_the_steady_state() {
    let mut interpreter = Interpreter::new(Settings::default());
    *interpreter.tools_mut() = ToolTable::parse(b"T1 P1 D6\n", |_, _| {}).expect("a tool");
    let mut source = MemorySource::new(PROGRAM.as_bytes());
    let (mut steps, mut begun) = (0, 0);
    loop {
        // Labels and names are known after the first rounds.
        if steps == 500 {
            begun = COUNT.get();
        }
        match interpreter.step(&mut source, &mut Nothing).expect("a correct program") {
            Status::Ended => break,
            _ => steps += 1,
        }
    }
    assert!(steps > 10_000, "{steps}");
    assert!(begun > 0, "nothing was counted");
    assert_eq!(COUNT.get() - begun, 0, "allocations in {} blocks", steps - 500);
}

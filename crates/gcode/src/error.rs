//! Everything that can be wrong with a program: one row per condition, with its stable identifier, its sentence and
//! its remedy.

use crate::source::SourceError;
use core::fmt;
use pkm_canon::Span;

/// A condition and the stretch of source it is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// What is wrong.
    pub kind: ErrorKind,
    /// Where.
    pub span: Span,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)
    }
}

impl core::error::Error for Error {}

/// A G or M number, kept times ten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code(pub i16);

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 % 10 {
            0 => write!(f, "{}", self.0 / 10),
            tenth => write!(f, "{}.{tenth}", self.0 / 10),
        }
    }
}

/// One row: `Variant { fields } "identifier" "message" "help";`
macro_rules! errors {
    ($($name:ident $({ $($field:ident : $kind:ty),+ })? $code:literal $message:literal $help:literal;)+) => {
        /// What can be wrong with a program. The numbers are those a person needs.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        #[allow(missing_docs)]
        pub enum ErrorKind {
            $(#[doc = concat!("`", $code, "`: ", $message)] $name $({ $($field: $kind),+ })?,)+
        }

        impl ErrorKind {
            /// The stable identifier.
            #[allow(unused_variables)]
            pub const fn code(&self) -> &'static str {
                match self {
                    $(Self::$name $({ $($field),+ })? => $code,)+
                }
            }

            /// What to do about it; empty where the message says it all.
            #[allow(unused_variables)]
            pub const fn help(&self) -> &'static str {
                match self {
                    $(Self::$name $({ $($field),+ })? => $help,)+
                }
            }

            /// Every identifier with its message pattern and help, for the manual.
            pub const CATALOGUE: &'static [(&'static str, &'static str, &'static str)] =
                &[$(($code, $message, $help)),+];
        }

        impl fmt::Display for ErrorKind {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match *self {
                    $(Self::$name $({ $($field),+ })? => write!(f, $message),)+
                }
            }
        }
    };
}

errors! {
    // File and line.
    FileEmpty "file-empty" "the file holds no block" "a program needs at least one block and M2 or M30";
    FileNoEndPercent "file-no-end" "the file ends without the closing %" "end the program with a line that holds only %, or with M2";
    FileNoEnd "file-no-end" "the file ends without M2 or M30" "end the program with M2 or M30, or frame it by two lines that hold only %";
    FileOpen { cause: SourceError } "file-open" "the source cannot be read ({cause:?})" "check that the file exists, can be read and is not a pipe";
    LineTooLong { limit: u16 } "line-too-long" "the line is longer than {limit} bytes" "split the block, or shorten its comment";
    BadChar { byte: u8 } "bad-char" "unexpected byte 0x{byte:02X}" "only printable ASCII letters, digits and signs may stand outside comments";
    BadLetter { letter: char } "bad-char" "'{letter}' does not begin a word here" "words are a letter and a number, such as X10";
    ByteOrderMark "bad-char" "the file begins with a byte order mark" "save the file as plain text without a byte order mark";
    UnclosedComment "unclosed-comment" "the comment is not closed on its line" "add ')', or begin the comment with ';'";
    NestedComment "nested-comment" "a '(' inside a comment" "comments do not nest: remove the inner parenthesis";
    // Numbers and words.
    BadNumber "bad-number" "not a number" "a number is an optional sign, digits and at most one point; there is no exponent";
    NumberMissing "bad-number" "a value is missing" "a word needs a number, [expression], #parameter or function";
    BadLineNumber "bad-number" "N needs digits" "line numbers are whole numbers without a sign";
    DoubleSign "bad-number" "two signs in a row" "write one sign, or brackets: -[-1]";
    NumberTooLarge { value: f64, limit: f64 } "number-range" "{value:e} is larger than {limit:e}" "use a value a machine can reach";
    NotInteger { value: f64 } "not-integer" "{value} is not a whole number" "this word needs a whole number (within 0.0001)";
    NegativeWord { letter: char, value: f64 } "negative-word" "{letter}{value} is negative" "this word needs 0 or more";
    NegativeF { value: f64 } "negative-f" "feed F{value} is negative" "use F0 or more";
    NegativeS { value: f64 } "negative-s" "speed S{value} is negative" "use S0 or more; M4 turns counter-clockwise";
    GRange { value: f64 } "g-range" "G{value} is no G number" "G numbers are 0 to 99.9 with one decimal";
    GUnknown { code: Code } "g-unknown" "G{code} is unknown" "see the manual for the codes this version understands";
    GUnsupported { code: Code } "g-unknown" "G{code} is not supported yet" "see the manual for the codes this version understands";
    MUnknown { number: i32 } "m-unknown" "M{number} is unknown" "see the manual for the codes this version understands";
    MUnsupported { number: i32 } "m-unknown" "M{number} is not supported yet" "see the manual for the codes this version understands";
    MTooMany { limit: u8 } "m-too-many" "more than {limit} M words in one block" "put some of them into the next block";
    ModalClashG { first: Code, second: Code, group: &'static str } "modal-clash" "G{second} and G{first} belong to one modal group ({group})" "use one of them per block";
    ModalClashM { first: i32, second: i32, group: &'static str } "modal-clash" "M{second} and M{first} belong to one modal group ({group})" "use one of them per block";
    WordRepeated { letter: char } "word-repeated" "a second {letter} word in the block" "use each letter once per block";
    WordUnused { letter: char, users: &'static str } "word-unused" "no code in this block uses the {letter} word (only {users} do)" "remove the word, or add the code it belongs to";
    RemapWord { letter: char } "word-missing" "the remapped code needs {letter}" "add it: its argspec asks for it";
    RemapZero { letter: char } "word-missing" "the remapped code needs {letter} greater than 0" "set it first: its argspec asks for it";
    WordMissing { letter: char, code: Code } "word-missing" "G{code} needs the {letter} word" "add it to the block";
    WordMissingM { letter: char, number: i32 } "word-missing" "M{number} needs the {letter} word" "add it to the block";
    AxisUnavailable { letter: char } "axis-unavailable" "this machine has no {letter} axis" "remove the word, or choose another machine";
    AxisClash { first: Code, second: Code } "axis-clash" "G{first} and G{second} both use the axis words" "put them into two blocks";
    AxisWithMachineCode { number: i32 } "axis-clash" "M{number} changes where the axes are, so nothing may move in its block" "move in a block of its own";
    AxisMissing { code: Code } "axis-missing" "G{code} needs an axis word" "say where to";
    AxisWithoutMotion "axis-without-motion" "axis words, but no motion code is in force" "begin the block with G0, G1 or another motion code";
    AxisWithG80 "axis-without-motion" "axis words with G80" "G80 ends cycles and moves nothing";
    // Parameters and expressions.
    ParamRange { value: f64 } "param-range" "there is no parameter #{value}" "parameters are #1 to #5601";
    ParamReadonly { index: i32 } "param-readonly" "#{index} can only be read" "assign to a parameter from #31 to #5000";
    ParamReadonlyNamed "param-readonly" "this predefined parameter can only be read" "use another name";
    ParamUndefined "param-undefined" "this parameter has no value yet" "assign to it first, or test it with EXISTS[#<name>]";
    ParamCc { index: i32 } "param-cc" "#{index} cannot be read while cutter compensation is on" "read it before G41 or after G40";
    ParamNameOpen "param-name" "the parameter name is not closed" "names look like #<name>";
    ParamNoMemory "param-memory" "named parameters need an interpreter with memory (feature alloc)" "use numbered parameters";
    ParameterFileDamaged "param-file" "the checksum does not fit the content" "the file was cut or changed: restore it from its .bak";
    ParameterFileCut "param-file" "the file is not whole" "restore it from its .bak; without a file all parameters begin at 0";
    ParameterFileLine "param-file" "not a parameter and its value" "write a number and a value, such as 5221 12.5";
    ParameterFileOrder { index: i32, last: i32 } "param-file" "parameter {index} comes after {last}" "numbers must rise";
    ParamElsewhere "param-elsewhere" "HAL pins and values of an INI file are not known here" "EXISTS[..] of them is 0 here; what depends on them in LinuxCNC is not checked";
    ParamNever "param-undefined" "nothing gives this parameter a value" "assign to it first, or test it with EXISTS[#<name>]";
    ParamUnset { index: i32 } "param-unset" "#{index} is read, but nothing sets it: it is 0" "set it first, or check the number";
    ParamNames { limit: u32 } "param-count" "more than {limit} named parameters" "use numbered parameters";
    EqualMissing "param-equal" "'=' is missing in a parameter setting" "write #1 = 2";
    TooManySettings { limit: u8 } "param-count" "more than {limit} parameter settings in one block" "split the block";
    ExprUnclosed "expr-unclosed" "the bracket is not closed" "add ']'";
    ExprDepth { limit: u8 } "expr-depth" "brackets nest deeper than {limit}" "store an inner result in a parameter";
    ExprOperator "expr-operator" "not an operator" "operators are + - * / ** MOD AND OR XOR EQ NE GT GE LT LE";
    ExprFunction "expr-function" "not a function" "functions are ABS ACOS ASIN ATAN COS EXISTS EXP FIX FUP LN ROUND SIN SQRT TAN";
    ExprBracket "expr-bracket" "the function needs its argument in brackets" "write SIN[30]";
    ExprAtan "expr-bracket" "ATAN needs two arguments" "write ATAN[y]/[x]";
    ExistsArgument "expr-bracket" "EXISTS needs a parameter" "write EXISTS[#<name>]";
    MathDiv0 "math-div0" "division by zero" "test the divisor first";
    MathPower "math-domain" "a negative base needs a whole exponent" "use ABS, or a whole exponent";
    MathSqrt { value: f64 } "math-domain" "square root of {value}" "the argument must not be negative";
    MathLn { value: f64 } "math-domain" "logarithm of {value}" "the argument must be greater than 0";
    MathAcos { value: f64 } "math-domain" "ACOS of {value}" "the argument must be between -1 and 1";
    MathAsin { value: f64 } "math-domain" "ASIN of {value}" "the argument must be between -1 and 1";
    MathNan "math-nan" "the calculation has no result" "check the values that enter it";
    MathInf "math-inf" "the result is too large" "check the values that enter it";
    // O-words.
    OUnknown "o-unknown" "not an o-word keyword" "after the label: sub endsub call return if elseif else endif while endwhile do repeat endrepeat break continue";
    OLabel "o-unknown" "the o-word has no label" "write o100 or o<name>";
    OTrailing "o-trailing" "text after the o-word" "put it on a line of its own";
    OLabelDuplicate "o-label-duplicate" "the label is used by another o-word at another line" "give each construct its own label";
    OLabelUnknown "o-label-unknown" "no open construct has this label" "use the label of the if, while, do or repeat it belongs to";
    OUnclosed "o-unclosed" "the construct that begins here is not closed" "add its end: endif, endwhile, while, endrepeat or endsub";
    ONestedSub "o-nested-sub" "a sub inside a sub" "end the first sub before the next begins";
    ORedefinedSub "o-redefined-sub" "this sub is defined already" "give it another label";
    ONotInSub "o-not-in-sub" "this o-word belongs inside a sub" "call it between sub and endsub";
    ONotFound "o-not-found" "the called sub is not in this file and has no file of its own" "define it, or add its folder to the subroutine path";
    OArgs { limit: u8 } "o-args" "more than {limit} arguments" "pass the rest through parameters";
    ODepth { limit: u8 } "o-depth" "calls nest deeper than {limit}" "end the recursion earlier";
    OStyle "o-style" "o-word subs and Fanuc programs do not mix" "use M98 and M99, or o call and endsub";
    ONoMemory "o-memory" "o-words need an interpreter with memory (feature alloc)" "unroll the program";
    M98NoP "m98-no-p" "M98 without P" "P is the number of the program to call";
    ONesting { limit: u8 } "o-nesting" "branches and loops nest deeper than {limit}" "put the inner ones into a sub";
    OTooMany { limit: u32 } "o-count" "more than {limit} different labels" "use labels again: each sub has its own";
    OUnused "o-unused" "this sub is never called" "call it, or remove it";
    LoopAlways "endless-loop" "nothing ends this loop: its condition is always true" "add a break, or a condition that changes";
    LoopUnchanged "endless-loop" "nothing in this loop changes what its condition reads" "change it in the loop, or add a break";
    EndlessLoop { blocks: u64 } "endless-loop" "{blocks} blocks without motion, dwell or input" "the loop does not end: check its condition, or raise --max-blocks";
    TooManyBlocks { limit: u64 } "too-many-blocks" "loops and subs have executed more than {limit} blocks" "check the condition of this loop, or raise --max-blocks";
    // Read otherwise than meant (static check).
    BlankInside "blank-inside" "blanks are ignored, so this reads as one number or name" "write it without blanks, or add the letter that is missing";
    PowerSign "power-sign" "the sign belongs to the number: -2**2 is 4" "write -[2**2] or [-2]**2";
    PowerChain "power-chain" "powers are taken from left to right: 2**3**2 is 64" "write brackets: 2**[3**2]";
    CommentInactive "comment-inactive" "behind ';' this text does nothing" "write it in parentheses";
    CommentSeveral "comment-several" "LinuxCNC acts only on the last comment of a line; here each one acts" "write one comment a line";
    // Run from line.
    StartInSub { line: u32 } "start-line" "line {line} is inside a sub or a subroutine's program" "begin at the line that calls it";
    StartInConstruct { line: u32 } "start-line" "line {line} is inside a branch or loop" "begin at the line where the outermost one begins";
    StartPastEnd { line: u32 } "start-line" "the program has no line {line} that is run" "begin at an earlier line";
    StartCompensation { line: u32 } "start-line" "cutter compensation is on at line {line}" "begin before G41 or G42, or after G40";
    StartSpline { line: u32 } "start-line" "line {line} is inside a spline" "begin before G5.2";
    StartIncremental "start-line" "the first move is incremental (G91): it would begin where the machine stands" "begin at a line with G90";
    StartArc "start-line" "the first move is an arc: it would begin where the machine stands" "begin at a straight move";
    StartUnknown "start-line" "what follows this block depends on what the machine did in it" "begin at this line or before it";
    // Feed, speed, spindle.
    FeedZero { code: Code } "feed-zero" "G{code} with feed 0" "set F first (G93, G94 and G95 make F unset)";
    FeedMissingG93 { code: Code } "feed-missing-g93" "G{code} without F in inverse time mode (G93)" "in G93 each move needs its own F";
    SpindleZeroG95 { code: Code } "spindle-zero-g95" "G{code} in feed per turn (G95) with spindle speed 0" "set S first";
    SpindleNotTurning { code: Code } "spindle-not-turning" "G{code} needs a turning spindle" "start it with M3 or M4";
    SpindleNumber { value: f64, last: u8 } "spindle-number" "there is no spindle {value}; the last is {last}" "spindles are numbered from $0";
    SpindleMissingS "word-missing" "G96 needs an S word" "S is the surface speed";
    // Arcs.
    ArcNoCentre { code: Code } "arc-no-centre" "G{code} without centre or radius" "add the centre words of the plane (I J, I K or J K), or R";
    ArcCentreAbsolute { code: Code } "arc-no-centre" "G{code} in G90.1 needs both centre words of the plane" "add the missing one, or switch to G91.1";
    ArcMixed "arc-mixed" "R together with centre words" "use either R or I J K";
    ArcWrongAxis { letter: char, plane: &'static str } "arc-wrong-axis" "{letter} is not a centre word of the {plane} plane" "use the centre words of the plane, or select another plane";
    ArcRadiusSmall { radius: f64, half_chord: f64 } "arc-radius-small" "radius {radius:.4} does not reach: half the distance to the end is {half_chord:.4}" "check R and the end point";
    ArcSameEnd "arc-same-end" "a radius arc that ends where it starts" "use I J K for a full circle";
    ArcAxisMissing { plane: &'static str } "arc-end-missing" "a radius arc needs an end word of the {plane} plane" "say where the arc ends";
    ArcZeroRadius { start: f64, end: f64 } "arc-zero-radius" "the arc's radius is 0 (at the start {start:.4}, at the end {end:.4})" "check the centre words";
    ArcRadiusMismatch { start: f64, end: f64, tolerance: f64 } "arc-radius-mismatch" "radius {start:.4} at the start, {end:.4} at the end; they may differ by {tolerance}" "check the end point and the centre words";
    ArcSpiral { difference: f64 } "arc-spiral" "the arc is a spiral: its radius differs by {difference:.4} between start and end" "check the end point and the centre words";
    ArcPlane "arc-plane" "no arcs in the planes of U V W" "select G17, G18 or G19";
    ArcTurns { value: f64 } "arc-turns" "P{value} turns" "P is a whole number of turns, 1 or more";
    // Dwell, moves, polar words.
    DwellMissing "word-missing" "G4 needs a P word of 0 or more" "P is the time in seconds";
    DwellWithArc "dwell-with-arc" "G4 in one block with an arc" "P would mean both: use two blocks";
    G53Motion "g53-motion" "G53 without G0 or G1" "write G53 G0 or G53 G1";
    G53Incremental "g53-incremental" "G53 in incremental mode (G91)" "select G90 first";
    PolarPlane "polar-plane" "polar words outside the XY plane" "select G17";
    PolarMixed { letter: char } "polar-mixed" "polar words together with {letter}" "use either @ and ^, or axis words";
    PolarOrigin "polar-origin" "the position is the origin, so it has no angle to keep" "give ^ too";
    IndexerFeed { letter: char } "indexer" "{letter} is a locking indexer: only G0 moves it" "move it by G0 in a block of its own";
    IndexerAlone { letter: char } "indexer" "{letter} is a locking indexer: it moves alone" "move it by G0 in a block of its own";
    WrappedRange { letter: char, value: f64 } "wrapped-range" "{letter}{value} on a wrapped rotary axis" "use 0 to 360, the sign gives the direction";
    // Cycles.
    CycleR { code: Code } "cycle-r" "G{code} needs R when the cycle begins" "R is the height where feeding begins";
    CycleDepth { code: Code, letter: char } "cycle-depth" "G{code} needs {letter} when the cycle begins" "it is the bottom of the hole";
    CycleRBelow { r: f64, depth: f64 } "cycle-r-below" "R {r:.4} is below the bottom {depth:.4}" "R must be above the bottom of the hole";
    CycleL0 "cycle-l0" "L0 with a cycle" "L is the number of repeats, 1 or more";
    CycleP { code: Code } "cycle-p" "G{code} needs P when the cycle begins" "P is the dwell in seconds";
    CycleQ { code: Code } "cycle-q" "G{code} needs Q greater than 0" "Q is the depth of one peck";
    CycleIjk { code: Code } "word-missing" "G{code} needs I, J and K when the cycle begins" "they give the offset and the height";
    CycleRotary { letter: char } "cycle-rotary" "{letter} in a cycle" "move the axis in a block before";
    CycleUvw "cycle-rotary" "axis words of the other linear set in a cycle" "XYZ cycles take no U V W, UVW cycles no X Y Z";
    CycleG93 { code: Code } "cycle-g93" "G{code} in inverse time mode" "select G94 or G95";
    CycleCc { code: Code } "cycle-cc" "G{code} while cutter compensation is on" "switch it off with G40 first";
    // Cutter compensation.
    CcOn { what: &'static str } "cc-on" "{what} while cutter compensation is on" "switch it off with G40 first";
    CcPlane "cc-plane" "cutter compensation outside the XY and XZ planes" "select G17 or G18";
    CcAlready "cc-already" "cutter compensation is on already" "switch it off with G40 first";
    CcEntry { length: f64, radius: f64 } "cc-entry" "the entry move is {length:.4} long, the tool radius is {radius:.4}" "make the first move after G41 or G42 longer than the tool radius";
    CcGouge "cc-gouge" "the tool would cut into the contour: the inside corner is too small for it" "use a smaller tool, or change the contour";
    CcConcave "cc-gouge" "the inside corner with this tool cannot be reached without gouging" "use a smaller tool, or change the contour";
    CcArcAfter "cc-arc-after" "an arc directly after G40" "the first move after G40 must be straight";
    CcTool { value: f64 } "cc-tool" "tool orientation {value} does not suit this plane" "lathe tools with orientation 1 to 9 need G18";
    // Probing.
    ProbeFeed "probe-feed" "probing with feed 0 or in feed per turn" "set F in G94";
    ProbeCc "probe-cc" "probing while cutter compensation is on" "switch it off with G40 first";
    ProbeShort { code: Code } "probe-short" "G{code} to where the tool stands" "give it a distance to search";
    // Tools and offsets.
    ToolUnknown { number: i32 } "tool-unknown" "tool {number} is not in the tool table" "add it to the tool table; with a random tool changer tool 0 too";
    ToolNotSelected "tool-missing" "M6, but no tool was selected" "select it with T first; T0 for none";
    ToolTableFull { limit: u16 } "tool-table-full" "more than {limit} tools" "remove some";
    ToolPocket { number: i32, pocket: i32 } "tool-pocket" "tool {number} in pocket {pocket}" "with a random tool changer each tool needs a pocket (P, 0 = the spindle) of its own";
    OffsetP { value: f64, first: i32, last: i32 } "offset-p" "G10 P{value}: P is a whole number from {first} to {last}" "name a coordinate system or a tool";
    OffsetL { value: f64 } "offset-l" "G10 L{value}" "L is 0, 1, 2, 10, 11 or 20";
    OffsetLMissing "offset-l" "G10 without L" "L is 0, 1, 2, 10, 11 or 20";
    OffsetWord { letter: char, l: i32 } "offset-p" "{letter} with G10 L{l}" "remove it";
    OffsetEmpty { code: Code } "offset-empty" "G{code} without a value" "name at least one value to set";
    ToolLoaded "tool-loaded" "the tool table cannot be read again while a tool is in the spindle" "unload it with T0 M6";
    // Inputs and outputs, state, splines, threads.
    IoMissing { number: i32, letter: char } "io-missing" "M{number} needs {letter}" "it is the number of the input or output";
    IoRange { number: i32, letter: char, value: f64 } "io-range" "M{number} with {letter}{value}" "see the manual for its range";
    IoTimeout "io-timeout" "M66 that waits needs Q greater than 0" "Q is the longest wait in seconds";
    OrientRange { letter: char, value: f64 } "io-range" "M19 with {letter}{value}" "R is 0 to 360, P 0 to 2, Q greater than 0";
    StateNone "state-none" "no stored state to restore" "store it with M70 first";
    SplineWords { code: Code, words: &'static str } "spline-words" "G{code} needs {words}" "add them to the block";
    SplineAxes { code: Code, planes: &'static str } "spline-words" "G{code} moves only the two axes of its plane ({planes}), without cutter compensation" "select the plane, use only its axes, and switch compensation off";
    NurbsPoints { points: u16, order: u16 } "nurbs-points" "{points} control points for order {order}" "a spline needs at least as many points as its order; G5.3 ends a G5.2, as many knots alone as the order says a G6.2";
    NurbsTooMany { limit: u16 } "nurbs-points" "more than {limit} control points" "split the curve";
    NurbsDropped { code: Code } "nurbs-points" "G{code} between the control points of a spline" "end the spline first: by G5.3, or by the last knots of G6.2";
    NurbsDroppedM { number: i32 } "nurbs-points" "M{number} between the control points of a spline" "end the spline first: by G5.3, or by the last knots of G6.2";
    NurbsWeight { letter: char, value: f64 } "spline-words" "weight {letter}{value}" "weights must be greater than 0";
    NurbsOrder { letter: char, value: f64 } "spline-words" "G6.2 with {letter}{value}" "P, the order, is a whole number from 2 on, the same in all blocks; Q is 1, 2 or 3";
    NurbsKnot { value: f64 } "nurbs-knots" "knot K{value}" "knots do not fall, and the first ones are equal, as many as the order P says; LinuxCNC's are whole numbers";
    ThreadIjk { letter: char } "thread-ijk" "G76 with this {letter} cuts no thread" "I is not 0, J greater than 0, K greater than J";
    ThreadPlane "thread-ijk" "G76 outside the XZ plane" "select G18";
    ThreadAxes "thread-ijk" "G76 moves only X and Z" "remove the other axis words";
    LathePlane { code: Code } "lathe-cycle" "G{code} outside the XZ plane" "select G18";
    LatheIncremental { code: Code } "lathe-cycle" "G{code} in incremental mode" "select G90";
    LatheAxis { letter: char } "lathe-cycle" "{letter} in a lathe cycle" "the cycles move only X and Z";
    LatheDepth { value: f64 } "lathe-cycle" "layers I{value} deep" "I is greater than 0";
    LathePasses { value: f64 } "lathe-cycle" "P{value} passes" "P is a whole number of passes, 1 to 10000";
    LatheLayers { limit: u16 } "lathe-cycle" "more than {limit} layers" "use a larger I, or begin nearer to the profile";
    LatheStart { code: Code } "lathe-cycle" "G{code} begins on the profile or below it" "X and Z, or the position, must lie in the stock's corner before and above the profile";
    LatheNoSub { number: i32 } "lathe-profile" "no sub o{number} stands before this line" "define the profile before the cycle: o100 sub, its moves, o100 endsub";
    LatheEmpty "lathe-profile" "the profile has no moves" "after the move to its begin a profile needs at least one more";
    LatheFirst "lathe-profile" "the first move of the profile is an arc" "begin with G0 or G1 to the first point";
    LatheMove { code: Code } "lathe-profile" "G{code} in a profile" "a profile consists of G0, G1, G2 and G3";
    LatheTooMany { limit: u16 } "lathe-profile" "more than {limit} moves in a profile" "divide it";
    LatheCorner "lathe-profile" "the fillet (A) or chamfer (C) does not fit" "it is greater than 0, alone, between two straight moves that meet in a corner and are long enough for it";
    LatheTurnsBack { axis: char } "lathe-profile" "the profile turns back in {axis} here" "along the cutting direction a profile goes only one way: divide it, or use the cycle of the other axis";
    LatheTurnsBackBoth "lathe-profile" "the profile turns back here" "it must go one way in Z or in X: divide it";
    LatheFlat { axis: char } "lathe-profile" "the profile does not lead along {axis}" "use the cycle of the other axis";
    QueueFull { limit: u16 } "cc-queue" "more than {limit} commands wait for the next move of cutter compensation" "move, or switch it off with G40";
    AbortComment "abort-comment" "the program stopped itself" "see the text of its (abort,) comment";
    CommentHash "comment-parameter" "a '#' without a parameter" "write #1 or #<name>";
    Python "comment-python" "Python is not supported" "remove the comment";
}

#[cfg(feature = "alloc")]
mod diagnostic {
    use super::Error;
    use alloc::{
        format,
        string::{String, ToString},
        vec::Vec,
    };
    use pkm_canon::diagnostic::{Diagnostic, Severity};

    impl Error {
        /// The diagnostic for a person: the message with the underlined text of `source_line`, place and remedy.
        /// `file` is the path as the person gave it.
        pub fn to_diagnostic(&self, file: &str, source_line: &[u8]) -> Diagnostic {
            let word = source_line.get(self.span.start as usize..self.span.end as usize).unwrap_or_default();
            let message = match word {
                [] => self.to_string(),
                word => format!("{self}: `{}`", String::from_utf8_lossy(word)),
            };
            let help = self.kind.help();
            Diagnostic {
                code: self.kind.code().to_string(),
                severity: Severity::Error,
                message,
                help: (!help.is_empty()).then(|| help.to_string()),
                file: file.to_string(),
                line: self.span.line,
                column: self.span.start + 1,
                end_column: self.span.end + 1,
                notes: Vec::new(),
            }
        }
    }
}

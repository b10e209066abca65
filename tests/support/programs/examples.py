"""Programs that tests of several rooms use, and what each has."""

SHIPPED = ("tables/task/acquire.rcs", "tables/examples/approach.rcs")

RICH = """
enum mode { idle, run, stop }
type level = int -5 .. 200
record report {
  echo : int 0 .. 9
  force : real -1.5 .. 8.0
}
input mode_in : mode
input width : int 0 .. 100 clamp
input far : int -3000000000 .. 3000000000
input huge : int 0 .. 18446744073709551615
input force : real -2.0 .. 2.0 clamp
input status : report
input at : int 0 .. 3
state phase : mode = idle deferred until status.echo = count
state count : int 0 .. 9
state kept : array[4] of int 0 .. 1000
state smooth : real -4.0 .. 4.0
output speed : level
output total : int 0 .. 4000
output big : int 0 .. 18446744073709551615

assume narrow monitored : mode_in = stop implies width < 100
assume calm assumed : mode_in = stop implies far < 2999999999

procedure add(by : int 0 .. 10) {
  if kept[at] <= 990 { kept[at] := kept[at] + by } else { kept[at] := 0 }
  total := 0
  for i in 0 .. 3 { total := min(total + kept[i], 4000) }
}
procedure turn {
  local half : real -2.0 .. 2.0 := force / 2.0
  smooth := max(-4.0, min(4.0, smooth * 0.5 + half))
  case mode_in { idle { next phase := run } run, stop { next phase := stop } }
  count := (count + 1) mod 10
}
procedure measure {
  speed := int(abs(force) * 10.0) - 5
  big := huge / 3 + huge mod 3
}
module sense reads far, width writes speed {
  if far > 2147483648 { speed := 200 } else if far / 7 < -300000000 { speed := -5 } else { speed := width }
}

table work assuming narrow, calm {
  | line | mode_in | phase   | width   | force  | when                 || procedures         | speed |
  | a    | idle    | /= stop | < 10    |        |                      || add(3); turn       | 1     |
  | b    | idle    | /= stop | >= 10   | < 0.0  |                      || turn               |       |
  | c    | idle    | /= stop | >= 10   | >= 0.0 | far > 5 or width = 7 || add(10)            | -5    |
  | d    | run     |         |         |        | huge > 9223372036854775807 || measure      |       |
  | e    | run     |         |         |        | not (huge > 9223372036854775807) || turn; add(1) | width |
  | f    | stop    |         | 0 .. 98 |        | at /= 3              || add(0)             | 0     |
  | g    | DEFAULT |         |         |        |                      || measure; turn      | 9     |
}
table rest {
  | line | width || procedures | speed |
  | 1    | < 50  || turn       |       |
  | 2    | >= 50 ||            | width |
}
level top {
  period 40 [ms]
  preprocess sense
  table by mode_in { idle : work  run : work  stop : rest }
  postprocess turn
}
"""

EXTERN = """
input part : int 0 .. 99
input force : real 0.0 .. 10.0
state height : int 0 .. 300
state kind : int -7 .. 5
state pull : real -1.0 .. 1.0
extern procedure look_up(times : int 0 .. 5) reads part, force writes height, kind, pull
  python "parts.database:height" c "parts_height"
procedure twice { look_up(2); if kind < 0 { look_up(1) }; height := 0 }
procedure often { twice; look_up(0); height := 7 }
table t {
  | line | part  || procedures |
  | 1    | < 50  || look_up(3) |
  | 2    | >= 50 || often      |
}
level top {
  period 10 [ms]
  preprocess twice
  table t
}
"""


STOPS = """
input a : int 0 .. 20
input b : int -9 .. 9
input x : real -4.0 .. 4.0
input which : int 0 .. 1
state seen : array[8] of int 0 .. 9
state n : int 0 .. 20
state ready : bool
output share : int -1000 .. 1000
output before : int 0 .. 20
output behind : int 0 .. 20
invariant few : n <= 8

assume calm monitored : x < 3.5
assume place assumed : a < 8
assume some monitored : b /= 0
assume low monitored : a <= 8

procedure mark { seen[a] := 9 }
procedure divide { share := 1000 / b }
procedure take { n := a }
procedure first { before := a }
procedure last { behind := a }

table sees assuming calm, place, some, low {
  | line | b    | x    || procedures   |
  | 1    | < 3  |      || mark; divide |
  | 2    | >= 3 | <= 1.0 || mark       |
  | 3    | >= 3 | > 1.0  ||            |
}
table keeps assuming calm, low, some {
  | line | 9 / b || procedures |
  | lo   | < 3   || take       |
  | hi   | >= 3  || take       |
}
level top {
  period 10 [ms]
  preprocess first
  table by which { 0 : sees  1 : keeps }
  postprocess last
}
"""
"""Assumptions that stop (of both standings, for an index, a division, a condition, an invariant), and one that tells."""


FAULTED = """
enum mode { off, slow, fast }
input a : int 0 .. 9
input b : int -3 .. 3
input x : real -4.0 .. 4.0 clamp
state seen : array[8] of int 0 .. 9
state again : int 0 .. 9
state phase : int 0 .. 9 deferred until b < 3
output hold : bool = true safe true
output pull : real -2.0 .. 2.0 safe 0.5
output pace : mode safe slow
output wide : int 0 .. 18446744073709551615 safe 18446744073709551615
output before : int 0 .. 9
output given : int 0 .. 9
output behind : int 0 .. 9
invariant slow_or_held : pace /= fast or hold
assume place monitored : a < 8
extern procedure ask reads a writes given, pull python "no_such:ask" c "ask"
procedure mark { seen[a] := 9; next phase := a; hold := false; pull := x / 2.0 }
procedure later { again := a }
procedure first { before := a }
procedure last { behind := a }
table t assuming place {
  | line | b      || procedures       | wide | pace |
  | 1    | -2..0  || mark; ask        | 3    | off  |
  | 2    | 0 .. 2 || mark; ask; later | 4    | slow |
}
level top {
  period 10 [ms]
  preprocess first
  table t
  postprocess last
}
"""
"""Every fault can be met: it is not proved. Outputs of each kind with a safe value, and some without."""


WALKER = """\
enum place { start, middle, end }
input go : bool
input echo : int 0 .. 2
state at : place = start deferred until echo = sent
state seen : bool
output sent : int 0 .. 2
procedure to(where : place) { next at := where  sent := (sent + 1) mod 3 }
procedure sense { seen := go }
table walk {
  | line | at     | seen  || procedures |
  | off  | start  | true  || to(middle) |
  | on   | middle | true  || to(end)    |
  | back | end    |       || to(start)  |
  | rest | /= end | false ||            |
}
level walker { period 40 [ms]  preprocess sense  table walk }
"""
"""A level that goes from place to place, each step taken when its number is echoed: a deferred state."""

LOOKING_BACK = """
enum mode { low, mid, high }
record pair { a : bool
  clamp_at : int 0 .. 9 }
input p : int 0 .. 9 = 2
input on : bool
input g : int 0 .. 2
input r : real 0.0 .. 1.0
state count : int 0 .. 9 = 3 restart 4
state m : mode restart mid
state list : array[3] of int 0 .. 9
state both : pair
output seen : array[12] of bool
output old : int 0 .. 9
assume calm monitored : p - was p <= 5
module tick reads count, list, both, p writes count, list, both {
  if count < 9 { count := count + 1 } else { count := 0 }
  list[count / 4] := p
  both.clamp_at := p
}
procedure see {
  old := was p
  seen[0] := @T(p >= 5) when on
  seen[1] := @F(p >= 5)
  seen[2] := @C(p) when not on and p > 3
  seen[3] := @C(count)
  seen[4] := was (p + count > 8)
  seen[5] := @T(list[count / 4] > 4)
  seen[6] := @C(both.clamp_at)
  seen[7] := not (@T(on) when p < 5) xor @F(on)
  seen[8] := m /= was m
  seen[9] := @C(r)
  seen[10] := @C(on)
  for i in 0 .. 2 { if was list[i] > 8 { seen[11] := @T(on) } }
}
table t assuming calm {
  | line | g | p        | when                            | @T(on) || m    | procedures |
  |------|---|----------|---------------------------------|--------||------|------------|
  | rise | 0 | > was p  |                                 |        || high | see        |
  | fall | 0 | <= was p | @T(p < 3) when m = high or on   |        || low  | see        |
  | stay | 0 | <= was p | not (@T(p < 3) when m = high or on) |    || mid  | see        |
  | on_  | 1 |          |                                 | true   || high | see        |
  | off  | 1 |          |                                 | false  ||      | see        |
}
level one { period 40 [ms] preprocess tick table t }
"""
"""Looks back at inputs, states, elements and fields; g = 2 ends the cycle with no line."""
LASTING = """
const delay = 0.3 [s]
input x : int 0 .. 9
input b : bool
state seen : array[7] of bool
state mode : int 0 .. 3
state early : bool
assume brief monitored : not (b for 1 [s])
procedure note {
  seen[0] := x > 3 for delay
  seen[1] := (x > 3 or b) for 200 [ms]
  seen[2] := not (b for 500 [ms])
  seen[3] := (not b) for 0.1 [s]
  seen[4] := x in {1, 2} for 200 [ms] and b
  seen[5] := x in 2 .. 7 for 0.2 [s]
  seen[6] := mode = 2 for 200 [ms]
}
module guess reads b writes early { early := b for 200 [ms] }
table watch assuming brief {
  | line  | b                | when                                   || mode | procedures |
  |-------|------------------|----------------------------------------||------|------------|
  | long  | true for 0.6 [s] |                                        || 3    | note       |
  | some  | true             | b for 200 [ms] and not (b for 600 [ms]) || 2    | note       |
  | short | true             | not (b for 200 [ms])                   || 1    | note       |
  | off   | false            |                                        || 0    | note       |
}
level button { period 100 [ms] preprocess guess table watch }
"""
"""Conditions that have to hold for a time, of inputs and states."""

EVERYTHING = """\
enum hue { red, green, blue }
record spot { x : int 0 .. 9 y : bool }
set odd : int 0 .. 9 = {1, 3, 5 .. 7}
const half = 0.5
input a : int 0 .. 9 clamp
input b : bool
input w : int 0 .. 255
input n : int -9223372036854775808 .. 9223372036854775807
input f : {real} -9.5 .. 9.5 clamp
input h : hue
input p : spot
state g : {real} -9.5 .. 9.5 = half deferred until b
state u : int 0 .. 18446744073709551615
state q : array[4] of int 0 .. 9
state r : array[2] of spot
output o : hue safe blue
output k : int 0 .. 9
assume seen monitored : a > 3 or b
invariant low : k < 9
property kept : k < 9
extern procedure ask(by : int 0 .. 9) reads a writes q[0] python "mymod:ask" c "my_ask"
procedure numbers { k := min(abs(a - 5), max(a / 2, 3)) mod 7 next g := min(max(f * 0.3, {real}(-1)), abs(f)) u := u / 3 }
procedure words { if w[3] and w = 0b01x1_xxx0 or (w & 12) = 4 { k := w[5..4] } k := count(b, p.y) }
procedure places(at : int 0 .. 3) { for i in 0 .. 3 { q[i] := i } q[at] := a r[1].x := p.x }
procedure colours { case h { red { o := green } green, blue { o := red } } }
procedure times { local t : bool := b for 2 [s] if @T(a > 3) when b or was a < a or t and int(f) > 2 { k := 1 } ask(3) }
owner first { words, times }
table mod_ assuming seen {
  | line  | a     | f     | w         || procedures         | o |
  |-------|-------|-------|-----------||--------------------|---|
  | case_ | > 3   | < 0.5 |           || numbers            |   |
  | more  | > 3   | >= 0.5 | xxx1 xxxx || words; places(3)  |   |
  | rest  | DEFAULT |     |           || colours            |   |
}
table mod {
  | line         | when          || procedures | k |
  |--------------|---------------||------------|---|
  | up           | n - 1 > 0 and n > -4 || numbers |   |
  | down above all | n = -3      ||            | a mod 3 |
  | not_odd      | n <= -4 and a not in odd || times | |
  | else         | DEFAULT       ||            |   |
}
level whole { period 40 [ms] preprocess first table by b { true : mod_ false : mod } postprocess colours }
"""
"""All of the language, with `real` or `single` for `{real}`."""

RELATED = """
const most = 9223372036854775807
input left : int 0 .. 600
input kept : int 1 .. 20
input part : int 0 .. 500
input turn : int -3 .. 3
input load : real 0.0 .. 500.0
input huge : int 0 .. most
input huger : int 0 .. 18446744073709551615
state share : int 0 .. 1000
state at : int 0 .. 3
state slack : real 0.0 .. 400.0
state whole : int 0 .. 500
state ring : array[4] of int -40 .. 40
state flags : array[4] of bool
state sum : int 0 .. 90
state long : int 0 .. most
output go : bool safe false
output seen : bool safe false

procedure relate(room : int 1 .. 600) {
  local more : int 0 .. 500 := left - kept
  share := 900 * more / part + room / room
  ring[at + 1] := 40 / turn
  slack := load - 100.0
  whole := int(slack)
  long := huge - 5
  seen := huger - 1 > 5
}

procedure loop {
  sum := 0
  for k in 0 .. 3 {
    local here : int -40 .. 40 := ring[k]
    if here > 0 and sum < 50 { sum := sum + here }
  }
  if not (at = 0 or ring[at - 1] = 7) { at := at - 1 }
  if at /= 3 { at := at + 1 } else { at := 0 }
  seen := flags[at]
}

table t {
  | line | left - kept | left - kept - part | at  | turn | load    | huge - 5 | huger   || procedures          | go    |
  | 1    | > 0         | <= 0              | < 3 | /= 0 | > 100.0 | >= 0     | <= most || relate(left - kept) | true  |
  | 2    | DEFAULT     |                   |     |      |         |          |         || loop                | false |
}

level l {
  period 10 [ms]
  table t
}
"""
"""Operations that are safe by what a line, or two variables together, say; and, in the other line, by what stands around them."""

WIDE = """
const most = 9223372036854775807
const least = -9223372036854775808
input a : int least .. most
input b : int least .. most
input d : int -5 .. 5
input u : int 0 .. 18446744073709551615
input x : real -1e300 .. 1e300
input y : real 0.0 .. 10.0
input z : single -1e30 .. 1e30
state sum : int least .. most
state quotient : int least .. most
state product : int least .. most
state size : int 0 .. most
state negative : int least .. most
state double : int 0 .. 18446744073709551615
state whole : int least .. most
state share : real 0.0 .. 20.0
state ratio : real 0.0 .. 20.0
state square : single 0.0 .. 100.0
output go : bool safe false

procedure relate {
  sum := a + b
  product := a * d
  quotient := a / d
  size := abs(a)
  negative := -a
  double := u + u
  whole := int(x * 2.0)
  share := 10.0 / y
  square := z * z
  case d { 1 { ratio := 4.0 / ratio } else { ratio := 1.0 / y } }
}

procedure rest {
  local part : int 1 .. 5
  if d > 0 { part := d }
  if d > 0 { sum := 10 / part } else { sum := 0 }
}

table t {
  | line | a             | b             | d   | u      | x           | y     | z             | ratio || procedures | go    |
  | 1    | -1000 .. 1000 | -1000 .. 1000 | > 0 | < 1000 | -5.0 .. 5.0 | > 1.0 | -10.0 .. 10.0 | > 0.5 || relate     | true  |
  | 2    | DEFAULT       |               |     |        |             |       |               |       || rest       | false |
}

level l {
  period 10 [ms]
  table t
}
"""
"""Operations on the widest numbers that are safe by what a line states of each, and a local that is read only where it was assigned."""

#!/bin/sh
# Fails if a program calls a vector intrinsic instead of containing the instruction.
#
# That happens where lane operations stand in a closure, or in a function that is not #[inline(always)]: the compiler
# outlines it without the instruction set of its caller. The results are right, three times slower, and nothing else
# says so. Reading the processor's features (cpuid, xgetbv) is the only call that is meant to be one.
#
# usage: tests/tools/check_inlining.sh PROGRAM...     (needs objdump; give it release builds)
set -eu

[ $# -gt 0 ] || { echo "usage: $0 PROGRAM..." >&2; exit 2; }
command -v objdump >/dev/null || { echo "$0: objdump is missing" >&2; exit 2; }

status=0
for program in "$@"; do
    [ -f "$program" ] || { echo "$0: $program: no such file" >&2; exit 2; }
    calls=$(objdump -dC --no-show-raw-insn "$program" |
        awk '/^[0-9a-f]+ <.*>:$/ { where = $0; sub(/^[0-9a-f]+ </, "", where); sub(/>:$/, "", where) }
             /(call|jmp) .*core_arch/ && !/xgetbv|cpuid/ { call = $0; sub(/^.*</, "", call); sub(/>$/, "", call)
                                                           print "  in " where ": " call }' |
        sort | uniq -c | sort -rn)
    if [ -n "$calls" ]; then
        echo "$program: vector intrinsics that are calls:" >&2
        echo "$calls" >&2
        status=1
    fi
done
exit $status

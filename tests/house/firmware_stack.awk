# The worst-case stack of the firmware, from the linked image itself, the C library's functions among it.
# usage: awk -f firmware_stack.awk CALLS=firmware_calls.txt symbols disassembly words
#   symbols      arm-none-eabi-nm lumirig.elf
#   disassembly  arm-none-eabi-objdump -d lumirig.elf
#   words        arm-none-eabi-objdump -s -j .text -j .ram_code -j .data -j .vectors lumirig.elf
#
# 1. A function's frame is what all its pushes and subtractions from sp add up to: never too small.
# 2. Calls are bl and branches into other functions. What goes through a pointer is said in CALLS; every function whose
#    address is stored anywhere must be in one of its groups, so that nothing is forgotten.
# 3. Functions that call one another in a ring count as often as CALLS says for one of them, all together.
# 4. Main, then one interrupt of each priority on top of it, the deepest there is, each with its exception frame.

function number(hex,   i, value, digit) {
    sub(/^0x/, "", hex)
    value = 0
    for (i = 1; i <= length(hex); i++) {
        digit = index("0123456789abcdef", tolower(substr(hex, i, 1))) - 1
        value = value * 16 + digit
    }
    return value
}
function complain(text) {
    print "firmware_stack: " text
    bad = 1
}
# How many registers "{r4, r5-r7, lr}" names.
function registers(list,   parts, n, i, ends, count) {
    gsub(/[{} ]/, "", list)
    n = split(list, parts, ",")
    for (i = 1; i <= n; i++)
        if (split(parts[i], ends, "-") == 2)
            count += substr(ends[2], 2) - substr(ends[1], 2) + 1
        else
            count++
    return count
}
function add_call(from, to) {
    if (!((from, to) in edge)) {
        edge[from, to] = 1
        callee[from, ++callees[from]] = to
    }
}
function add_by_name(from, name,   n, i, list) {
    if (!(name in addresses)) {
        complain("no function " name " is in the image, but the table of calls names it")
        return
    }
    n = split(addresses[name], list, " ")
    for (i = 1; i <= n; i++)
        add_call(from, list[i])
}
function add_group(from, group,   n, i, list) {
    if (!(group in members)) {
        complain("no group " group)
        return
    }
    used[group] = 1
    n = split(members[group], list, " ")
    for (i = 1; i <= n; i++)
        if (list[i] in addresses)
            add_by_name(from, list[i])
}
# Tarjan: rings of calls. Sets `ring[f]` and, when a ring is complete, its cost.
function visit(f,   i, g) {
    order[f] = low[f] = ++visited
    pile[++depth] = f
    piled[f] = 1
    for (i = 1; i <= callees[f]; i++) {
        g = callee[f, i]
        if (!(g in order)) {
            visit(g)
            if (low[g] < low[f])
                low[f] = low[g]
        } else if (piled[g] && order[g] < low[f]) {
            low[f] = order[g]
        }
    }
    if (low[f] == order[f])
        close_ring(f)
}
function close_ring(f,   g, i, count, sum, below, times, h, names, in_ring, list) {
    do {
        g = pile[depth--]
        piled[g] = 0
        ring[g] = f
        list[++count] = g
        in_ring[g] = 1
        sum += frame[g]
        if (name[g] in recursion && recursion[name[g]] > times)
            times = recursion[name[g]]
        names = names " " name[g]
    } while (g != f)
    if (count == 1 && !((f, f) in edge))
        times = 1
    else if (!times) {
        complain("calls in a ring, and no bound is given:" names)
        times = 1
    }
    below = 0
    for (i = 1; i <= count; i++)
        for (h = 1; h <= callees[list[i]]; h++) {
            g = callee[list[i], h]
            if (!(g in in_ring) && worst[g] >= below) {
                below = worst[g]
                deepest = g
            }
        }
    for (i = 1; i <= count; i++) {
        worst[list[i]] = times * sum + below
        next_down[list[i]] = below > 0 ? deepest : 0
    }
}
function path(f,   text) {
    text = name[f]
    for (f = next_down[f]; f; f = next_down[f])
        text = text " > " name[f] "(" frame[f] ")"
    return text
}
function reach(f, from,   i) {
    if (f in reached)
        return
    reached[f] = from
    if (name[f] ~ /^__aeabi_(d|cd|[a-z0-9]+2d)|^__(add|sub|mul|div|cmp|eq|ne|lt|le|gt|ge|unord|neg)df|^__float.*df$|^__fix.*df/)
        complain("double arithmetic (" name[f] ") in an interrupt, called from " from)
    for (i = 1; i <= callees[f]; i++)
        reach(callee[f, i], name[f])
}

FNR == 1 { part++ }
FILENAME == CALLS {
    sub(/#.*/, "")
    if (NF == 0)
        next
    word = $2
    sub(/:$/, "", word)
    if ($1 == "group") {
        members[word] = members[word] " "
        for (i = 3; i <= NF; i++)
            members[word] = members[word] " " $i
    } else if ($1 == "through") {
        for (i = 3; i <= NF; i++)
            through[word] = through[word] " " $i
    } else if ($1 == "default") {
        fallback = $2
    } else if ($1 == "recursion") {
        recursion[word] = $3
    } else if ($1 == "interrupt") {
        for (i = 3; i <= NF; i++) {
            level[$i] = word
            entries[++entry_count] = $i
        }
    }
    next
}
# nm: code symbols
part == 2 && $2 ~ /^[tTwW]$/ {
    at = number($1)
    if (at % 2)
        at--
    if (!(at in name))
        name[at] = $3
    addresses[$3] = addresses[$3] " " at
    next
}
part == 3 && /^[0-9a-f]+ <.*>:$/ {
    current = number($1)
    label = $2
    gsub(/[<>:]/, "", label)
    if (!(current in name) && label !~ /_veneer$/)
        next # data among the code
    name[current] = label
    starts[++functions] = current
    next
}
part == 3 && /^ *[0-9a-f]+:\t/ {
    n = split($0, column, "\t")
    op = column[3]
    rest = column[4]
    owner[number(substr($1, 1, length($1) - 1))] = current
    if (op ~ /^(push|stmdb|vpush)/ && (op ~ /push/ || rest ~ /^sp!/)) {
        sub(/^sp!, */, "", rest)
        frame[current] += 4 * registers(rest) * (op ~ /^v/ ? 2 : 1)
    } else if (op ~ /^sub/ && rest ~ /^sp, /) {
        amount = rest
        sub(/[;@].*/, "", amount)
        if (amount !~ /#[0-9]+/)
            complain(name[current] ": sp is moved by a register")
        sub(/.*#/, "", amount)
        frame[current] += amount
    } else if (rest ~ /\[sp, #-[0-9]+\]!/) {
        amount = rest
        sub(/.*\[sp, #-/, "", amount)
        sub(/\].*/, "", amount)
        frame[current] += amount
    } else if (op == "blx" || (op == "bx" && rest !~ /^lr/) || (op ~ /^ldr/ && rest ~ /^pc, \[pc/ && name[current] ~ /_veneer$/)) {
        indirect[current] = 1
    } else if (op ~ /^(bl|b|b[a-z][a-z]|cbn?z)(\.[nw])?$/) {
        target = rest
        sub(/^r[0-9]+, */, "", target)
        sub(/ .*/, "", target)
        jumps[++jump_count] = current " " number(target)
    }
    next
}
# Words of memory: little-endian, as four groups of hex digits.
part == 4 && /^ [0-9a-f]+ / {
    for (i = 2; i <= 5 && $i ~ /^[0-9a-f]+$/ && length($i) == 8; i++) {
        value = number(substr($i, 7, 2) substr($i, 5, 2) substr($i, 3, 2) substr($i, 1, 2))
        if (value % 2)
            stored[value - 1] = 1
    }
}
END {
    for (i = 1; i <= jump_count; i++) {
        split(jumps[i], pair, " ")
        target = pair[2]
        if (target in owner && owner[target] != pair[1])
            add_call(pair[1] + 0, owner[target])
    }
    for (f in indirect) {
        n = split(name[f] in through ? through[name[f]] : fallback, list, " ")
        for (i = 1; i <= n; i++)
            add_group(f + 0, list[i])
    }
    for (group in members) {
        n = split(members[group], list, " ")
        for (i = 1; i <= n; i++)
            grouped[list[i]] = 1
    }
    for (i = 1; i <= functions; i++) {
        f = starts[i]
        if (f in stored && !(name[f] in grouped) && !(name[f] in level))
            complain("the address of " name[f] " is stored, and no group of the table has it")
        if (!(f in order))
            visit(f)
    }
    n = split(addresses["Reset_Handler"], list, " ")
    main_stack = worst[list[1]]
    printf "main %d: %s\n", main_stack, path(list[1])
    for (i = 1; i <= entry_count; i++) {
        n = split(addresses[entries[i]], list, " ")
        if (!n) {
            complain("no interrupt " entries[i])
            continue
        }
        f = list[1]
        reach(f, entries[i])
        printf "priority %d: %s %d\n", level[entries[i]], path(f), worst[f]
        if (worst[f] + 40 > most[level[entries[i]]])
            most[level[entries[i]]] = worst[f] + 40 # exception frame: 8 words, and 8 bytes of alignment (B1.5.6)
    }
    total = main_stack
    for (l in most)
        total += most[l]
    printf "stack %d of %d bytes\n", total, BOUND
    if (total > BOUND)
        complain("the stack can grow to " total " bytes, " BOUND " are reserved")
    if (functions < 100 || main_stack < 100)
        complain("this does not look like a firmware")
    exit bad
}

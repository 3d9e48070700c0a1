#!/usr/bin/env python3
"""strip-effects.py OUT -DFEATURES=N ...: the kernels of cl/ with what those features leave out removed from the source.

What `make bench-effects` compares with: a renderer in which that code was never written. The preprocessor replaces the
feature macros by numbers; then every `if`, `?:`, `&&` and `||` that hangs on numbers alone is decided, statements
behind a return are dropped, and so are functions that nobody calls any more. OUT is a folder for BRUME_CL_DIR.
"""
import os
import re
import subprocess
import sys

TOKEN = re.compile(r'#[^\n]*\n|"(?:\\.|[^"\\])*"|0[xX][0-9a-fA-F.]+(?:[pP][+-]?\d+)?\w*'
                   r'|\d[\w.]*(?:(?<=[eE])[+-]\d+\w*)?'
                   r'|\.\d\w*|\w+|->|\+\+|--|<<=|>>=|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[^\s\w]')
CLOSING = {'(': ')', '{': '}', '[': ']'}
INTEGER = re.compile(r'(0[xX][0-9a-fA-F]+|\d+)[uU]?$')
OPERATORS = {'(', ')', '==', '!=', '<', '>', '<=', '>=', '&', '|', '+', '-', '*', '<<', '>>', '&&', '||', '!', '^'}
BOUNDARIES = {'=', ',', ';', 'return', '+=', '-=', '*=', '/=', '|=', '&=', '^=', '<<=', '>>=', 'case'}


def tree(tokens, at=0, closing=None):
    """Nested lists [opening, ..., closing] for brackets."""
    out = []
    while at < len(tokens):
        t = tokens[at]
        if t == closing:
            return out, at + 1
        if t in CLOSING:
            inner, at = tree(tokens, at + 1, CLOSING[t])
            out.append([t] + inner + [CLOSING[t]])
        else:
            out.append(t)
            at += 1
    return out, at


def flat(nodes):
    for n in nodes:
        if isinstance(n, list):
            yield from flat(n)
        else:
            yield n


def constant(nodes):
    """The value of an expression of integers, None if it is anything else."""
    text = []
    for t in flat(nodes):
        if INTEGER.match(t):
            text.append(t.rstrip('uU'))
        elif t in OPERATORS:
            text.append({'&&': ' and ', '||': ' or ', '!': ' not '}.get(t, t))
        else:
            return None
    try:
        return int(eval(''.join(text), {'__builtins__': {}}))
    except (SyntaxError, TypeError):
        return None


def split(nodes, separator):
    parts = [[]]
    for n in nodes:
        if n == separator:
            parts.append([])
        else:
            parts[-1].append(n)
    return parts


def join(parts, separator):
    out = []
    for i, p in enumerate(parts):
        out += ([separator] if i else []) + p
    return out


def fold_logic(nodes):
    """One expression without ?: and , at its top level."""
    if len(split(nodes, '||')) > 1:
        kept = []
        for p in split(nodes, '||'):
            p = fold_logic(p)
            value = constant(p)
            if value:
                kept.append(['1'])
                break
            if value is None:
                kept.append(p)
        return join(kept, '||') if kept else ['0']
    if len(split(nodes, '&&')) > 1:
        kept = []
        for p in split(nodes, '&&'):
            value = constant(p)
            if value == 0:
                return ['0'] if not kept else join(kept + [['0']], '&&')
            if value is None:
                kept.append(p)
        return join(kept, '&&') if kept else ['1']
    return nodes


def fold(nodes):
    """An expression, or several with what stands between them."""
    nodes = [fold_group(n) if isinstance(n, list) else n for n in nodes]
    out, part = [], []
    for n in nodes + [None]:
        if n is None or (isinstance(n, str) and n in BOUNDARIES):
            out += fold_choice(part)
            part = []
            if n is not None:
                out.append(n)
        else:
            part.append(n)
    return out


def fold_choice(nodes):
    if '?' not in nodes:
        return fold_logic(nodes)
    question = nodes.index('?')
    depth, colon = 0, None
    for i in range(question + 1, len(nodes)):
        if nodes[i] == '?':
            depth += 1
        elif nodes[i] == ':':
            if depth == 0:
                colon = i
                break
            depth -= 1
    condition = fold_logic(nodes[:question])
    yes, no = fold_choice(nodes[question + 1:colon]), fold_choice(nodes[colon + 1:])
    value = constant(condition)
    if value is None:
        return condition + ['?'] + yes + [':'] + no
    return yes if value else no


def fold_group(group):
    inner = fold(group[1:-1])
    value = constant(inner) if group[0] == '(' and len(inner) > 1 else None
    return [group[0]] + ([str(value)] if value is not None else inner) + [group[-1]]


def statement(nodes, at):
    """One statement, simplified, and where the next one starts."""
    n = nodes[at]
    if n == 'if':
        condition = fold(nodes[at + 1][1:-1])
        value = constant(condition)
        yes, at = statement(nodes, at + 2)
        no = None
        if at < len(nodes) and nodes[at] == 'else':
            no, at = statement(nodes, at + 1)
        if value is not None:
            return (yes if value else no or [], at)
        return ['if', ['('] + condition + [')']] + (yes or [['{', '}']]) + (['else'] + no if no else []), at
    if n in ('for', 'while', 'switch') and nodes[at + 2] != ';':
        body, end = statement(nodes, at + 2)
        return [n, fold_group(nodes[at + 1])] + (body or [['{', '}']]), end
    if isinstance(n, list) and n[0] == '{':
        return [['{'] + block(n[1:-1]) + ['}']], at + 1
    if n == 'do':
        body, end = statement(nodes, at + 1)
        rest, end = statement(nodes, end)
        return ['do'] + body + rest, end
    if isinstance(n, str) and n.startswith('#'):
        following, end = statement(nodes, at + 1)  # a pragma belongs to what follows
        return [n] + following, end
    end = at
    while end < len(nodes) and nodes[end] != ';':
        end += 1
    return fold(nodes[at:end]) + [';'], end + 1


def block(nodes):
    out, at = [], 0
    while at < len(nodes):
        s, at = statement(nodes, at)
        if len(s) == 1 and isinstance(s[0], list) and 'return' in s[0]:
            i = s[0].index('return')
            if s[0][-2] == ';' and ';' not in s[0][i:-2]:
                return out + s  # an undivided block that returns
        out += s
        if s and s[0] == 'return':
            return out
    return out


def items(nodes):
    """Top level: (function name or None, tokens)."""
    out, part = [], []
    for n in nodes:
        if isinstance(n, str) and n.startswith('#'):
            out.append((None, part + [n]))
            part = []
            continue
        part.append(n)
        is_body = isinstance(n, list) and n[0] == '{' and len(part) > 1 and isinstance(part[-2], list) \
            and part[-2][0] == '(' and 'typedef' not in part
        if is_body:
            name = part[-3]
            body = ['{'] + block(n[1:-1]) + ['}']
            out.append((None if '__kernel' in part else name, part[:-1] + [body]))
            part = []
        elif n == ';':
            out.append((None, part))
            part = []
    return out + ([(None, part)] if part else [])


def main():
    folder, options = sys.argv[1], sys.argv[2:]
    here = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'cl')
    # What the build gives, it still gives.
    keep = ['-DBVH_STACK=BVH_STACK', '-DLOCAL_SIZE=LOCAL_SIZE']
    text = subprocess.run(['clang', '-E', '-P', '-x', 'cl', '-cl-std=CL1.2', '-cl-no-stdinc', '-target',
                           'spir64-unknown-unknown', '-DBRUME_DEVICE=1', *keep, *options, '-I', here,
                           os.path.join(here, 'path.cl')],
                          check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout
    nodes, _ = tree(TOKEN.findall(text))
    parts = items(nodes)
    before = len(parts)
    while True:
        used = {}
        for name, part in parts:
            for t in set(flat(part)):
                used[t] = used.get(t, 0) + 1
        kept = [(name, part) for name, part in parts if name is None or used[name] > 1]
        if len(kept) == len(parts):
            break
        parts = kept
    lines = []
    for _, part in parts:
        line = ' '.join(flat(part))
        lines.append(re.sub(r'(#[^\n]*\n)', r'\n\1', line).replace('; ', ';\n').replace('{ ', '{\n'))
    out = '\n'.join(lines) + '\n'
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, 'path.cl'), 'w') as f:
        f.write(out)
    print('%s: %d of %d parts, %d of %d bytes' % (folder, len(parts), before, len(out), len(text)))


main()

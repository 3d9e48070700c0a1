"""Following the links of a node tree: through reroutes, muted links and into and out of groups."""


class Place:
    """A node output, or an input that nothing usable is linked to; `stack` holds the group nodes it lies within."""

    def __init__(self, node, socket, stack):
        self.node, self.socket, self.stack = node, socket, stack

    def input(self, name, index=0):
        """The Place that feeds an input of this node; None if there is no such input."""
        found = [socket for socket in self.node.inputs if socket.name == name]
        return follow(found[index], self.stack) if index < len(found) else None


def _same(sockets, identifier):
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def follow(socket, stack=()):
    """The Place whose value `socket` gets. Its node is None where that is the default_value of its socket."""
    while socket.is_linked and not socket.links[0].is_muted:
        node, output = socket.links[0].from_node, socket.links[0].from_socket
        if node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree and not node.mute:
            inner = next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
            inside = inner and _same(inner.inputs, output.identifier)
            if not inside:
                break
            socket, stack = inside, stack + (node,)
        elif node.type == "GROUP_INPUT" and stack:
            outside = _same(stack[-1].inputs, output.identifier)
            if not outside:
                break
            socket, stack = outside, stack[:-1]
        elif node.mute and node.internal_links:
            through = next((link for link in node.internal_links if link.to_socket == output), None)
            if not through:
                break
            socket = through.from_socket
        else:
            return Place(node, output, stack)
    return Place(None, socket, stack)


def output(tree, socket_name):
    """What the tree's output for Cycles gets as its Surface or Volume; None if nothing is linked there."""
    node = tree.get_output_node("CYCLES") if tree else None
    socket = node.inputs.get(socket_name) if node else None
    place = follow(socket) if socket else None
    return place if place and place.node else None


def label(owner, node):
    return "%s, node %s" % (owner, node.name)


def constant(place):
    """The value as a tuple of three numbers, or one; None if it isn't the same everywhere."""
    if place is None:
        return None
    if place.node is None:
        value = getattr(place.socket, "default_value", None)
    elif place.node.type in ("RGB", "VALUE"):
        value = place.socket.default_value
    else:
        return None
    if value is None:
        return None
    return tuple(value)[:3] if hasattr(value, "__len__") else float(value)


def scalar(report, owner, node_place, name, otherwise=0.0):
    """A number of an input of node_place.node; where it varies, the input's own value with a warning."""
    place = node_place.input(name)
    if place is None:
        return otherwise
    value = constant(place)
    if value is None:
        socket = next(s for s in node_place.node.inputs if s.name == name)
        value = socket.default_value
        report.warn(label(owner, node_place.node), "%s comes from the node %s" % (name, place.node.name),
                    "exported as %.4g everywhere" % value)
    return sum(value) / 3 if isinstance(value, tuple) else value


def colour(report, owner, node_place, name):
    """Like scalar, three numbers."""
    place = node_place.input(name)
    value = constant(place)
    if value is None:
        socket = next(s for s in node_place.node.inputs if s.name == name)
        value = tuple(socket.default_value)[:3]
        report.warn(label(owner, node_place.node), "%s comes from the node %s" % (name, place.node.name),
                    "exported as (%.4g, %.4g, %.4g) everywhere" % value)
    return value if isinstance(value, tuple) else (value,) * 3

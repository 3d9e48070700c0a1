// mesh_obj.cc -- OBJ through tinyobjloader, which is C++: nothing it throws leaves this file.
//
// The parser takes what it can't read for 0 and skips faces with unknown vertices. A pass over the text before it
// demands numbers where numbers belong, so that such a file is an error with its line and not a wrong picture.
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <istream>
#include <new>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <unordered_map>
#include <vector>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

extern "C" {
#include "load_progress.h"
#include "mesh_finish.h"
#include "mesh_polygon.h"
#include "text.h"
}

namespace {

// One reason why a file is refused; line 0 for none.
struct refusal {
    brume_result code = BRUME_ERROR_SCENE;
    size_t line = 0;
    std::string what;
};

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// How many numbers a line holds after its keyword, or -1 if something else is among them.
int count_numbers(const char *at, const char *end) {
    int count = 0;
    while (at < end) {
        while (at < end && blank(*at)) at++;
        if (at == end || *at == '#') break;
        const char *word = at;
        while (at < end && !blank(*at)) at++;
        size_t length = static_cast<size_t>(at - word);
        if (length != strspn(word, "+-.0123456789eE") || !strpbrk(std::string(word, length).c_str(), "0123456789"))
            return -1;
        count++;
    }
    return count;
}

// The parser ends a line at a lone CR, too: so do the passes before it.
void end_lines(std::string &text) {
    for (size_t at = text.find('\r'); at != std::string::npos; at = text.find('\r', at + 1))
        if (at + 1 == text.size() || text[at + 1] != '\n') text[at] = '\n';
}

// Looks at v, vn and vt only; faces are left to the parser. Vertex count limits its index arithmetic.
bool check_numbers(const char *text, size_t size, refusal *why) {
    const char *at = text, *end = text + size;
    for (size_t line = 1; at < end; line++) {
        const char *next = static_cast<const char *>(memchr(at, '\n', static_cast<size_t>(end - at)));
        const char *stop = next ? next : end;
        while (at < stop && blank(*at)) at++;
        int wanted = 0, keyword = 0;
        if (stop - at > 2 && at[0] == 'v') {
            if (blank(at[1])) wanted = 3, keyword = 1;
            if (at[1] == 'n' && blank(at[2])) wanted = 3, keyword = 2;
            if (at[1] == 't' && blank(at[2])) wanted = 1, keyword = 2;
        }
        if (wanted && count_numbers(at + keyword, stop) < wanted) {
            why->line = line;
            why->what = "expected " + std::string(wanted == 3 ? "three numbers" : "numbers") + " after " +
                        std::string(at, static_cast<size_t>(keyword));
            return false;
        }
        at = next ? next + 1 : end;
    }
    return true;
}

// Bones' weights (vw), which no surface needs, become comments: the parser turns any number there into an int.
void hide_weights(std::string &text) {
    for (size_t at = 0; at < text.size();) {
        size_t word = text.find_first_not_of(" \t\r", at), end = text.find('\n', at);
        if (word != std::string::npos && text.compare(word, 2, "vw") == 0) text[word] = '#';
        at = end == std::string::npos ? text.size() : end + 1;
    }
}

// "... line 12.)" in a message of the parser.
size_t line_of(const std::string &message) {
    size_t at = message.find("line ");
    if (at == std::string::npos) at = message.find("line: ");
    at = at == std::string::npos ? at : message.find_first_of("0123456789", at);
    return at == std::string::npos ? 0 : std::strtoul(message.c_str() + at, nullptr, 10);
}

// Who is told how far a file has been read, and may end that.
struct listener {
    brume_context *context;
    const char *path;
    bool cancelled;
    bool goes_on(double fraction) {
        if (!cancelled) cancelled = !brume_load_goes_on(context, path, fraction);
        return !cancelled;
    }
};

// Reading the text is so much of the work; making a mesh of it is the rest.
const double PARSING = 0.75;

// The text in pieces, the end of which is where somebody is told.
class pieces : public std::streambuf {
public:
    pieces(std::string &text, listener *who) : text_(text), who_(who) {}

protected:
    int_type underflow() override {
        const size_t piece = 1 << 18;
        size_t left = text_.size() - next_, size = left < piece ? left : piece;
        if (!size || !who_->goes_on(PARSING * static_cast<double>(next_) / static_cast<double>(text_.size())))
            return traits_type::eof();
        setg(&text_[next_], &text_[next_], &text_[next_] + size);
        next_ += size;
        return traits_type::to_int_type(*gptr());
    }

private:
    std::string &text_;
    listener *who_;
    size_t next_ = 0;
};

bool refuse_cancelled(refusal *why) {
    why->code = BRUME_CANCELLED;
    why->line = 0;
    why->what = "reading was cancelled";
    return false;
}

struct corner {
    int v, n, t;
    bool operator==(const corner &o) const { return v == o.v && n == o.n && t == o.t; }
};

struct corner_hash {
    size_t operator()(const corner &c) const {
        uint64_t h = static_cast<uint32_t>(c.v) * UINT64_C(0x9e3779b97f4a7c15);
        h = (h ^ static_cast<uint32_t>(c.n)) * UINT64_C(0xff51afd7ed558ccd);
        h = (h ^ (h >> 32) ^ static_cast<uint32_t>(c.t)) * UINT64_C(0xc4ceb9fe1a85ec53);
        return static_cast<size_t>(h ^ (h >> 29));
    }
};

template <class T> T *copy(const std::vector<T> &from) {
    T *to = static_cast<T *>(malloc(from.size() * sizeof(T)));
    if (!to) throw std::bad_alloc();
    memcpy(to, from.data(), from.size() * sizeof(T));
    return to;
}

bool convert(const tinyobj::attrib_t &attrib, const std::vector<tinyobj::shape_t> &shapes, listener *who, refusal *why,
             brume_mesh *out) {
    const int vertices = static_cast<int>(attrib.vertices.size() / 3),
              normals = static_cast<int>(attrib.normals.size() / 3),
              uvs = static_cast<int>(attrib.texcoords.size() / 2);
    std::unordered_map<corner, uint32_t, corner_hash> seen;
    std::vector<float> positions, out_normals, out_uvs;
    std::vector<uint32_t> triangles;
    bool any_normal = false, any_uv = false;
    std::vector<uint32_t> polygon;
    size_t faces = 0, face = 0;
    for (const tinyobj::shape_t &shape : shapes) faces += shape.mesh.num_face_vertices.size();
    for (const tinyobj::shape_t &shape : shapes) {
        size_t at = 0, all = 0;
        for (size_t corners : shape.mesh.num_face_vertices) all += corners;
        if (all != shape.mesh.indices.size()) {  // the parser counts in a byte
            why->what = "a face has more than 255 corners";
            return false;
        }
        for (size_t corners : shape.mesh.num_face_vertices) {
            if (face++ % (1 << 14) == 0 &&
                !who->goes_on(PARSING + (1 - PARSING) * static_cast<double>(face) / static_cast<double>(faces)))
                return refuse_cancelled(why);
            polygon.clear();
            for (size_t k = 0; k < corners; k++) {
                const tinyobj::index_t &index = shape.mesh.indices[at++];
                corner c = {index.vertex_index, index.normal_index, index.texcoord_index};
                if (c.v < 0 || c.v >= vertices || c.n >= normals || c.t >= uvs) {
                    why->what = "a face names a vertex, normal or texture coordinate that the file doesn't have";
                    return false;
                }
                auto found = seen.emplace(c, static_cast<uint32_t>(seen.size()));
                polygon.push_back(found.first->second);
                if (!found.second) continue;
                any_normal |= c.n >= 0;
                any_uv |= c.t >= 0;
                for (int i = 0; i < 3; i++) {
                    positions.push_back(attrib.vertices[3 * static_cast<size_t>(c.v) + i]);
                    // Zero: the scene's arrays put the faces' mean there.
                    out_normals.push_back(c.n >= 0 ? attrib.normals[3 * static_cast<size_t>(c.n) + i] : 0);
                }
                for (int i = 0; i < 2; i++)
                    out_uvs.push_back(c.t >= 0 ? attrib.texcoords[2 * static_cast<size_t>(c.t) + i] : 0);
            }
            if (corners < 3) continue;
            size_t before = triangles.size();
            triangles.resize(before + 3 * (corners - 2));
            brume_polygon_cut(polygon.data(), corners, positions.data(), triangles.data() + before);
        }
    }
    if (triangles.size() > INT32_MAX) {
        why->what = "the file holds too many triangles";
        return false;
    }
    out->vertex_count = static_cast<uint32_t>(seen.size());
    out->triangle_count = static_cast<uint32_t>(triangles.size() / 3);
    if (triangles.empty()) return true;
    out->positions = copy(positions);
    out->triangles = copy(triangles);
    if (any_normal) out->normals = copy(out_normals);
    if (any_uv) out->uvs = copy(out_uvs);
    return true;
}

bool parse(std::istream &stream, listener *who, refusal *why, brume_mesh *out) {
    tinyobj::attrib_t attrib;
    std::vector<tinyobj::shape_t> shapes;
    std::vector<tinyobj::material_t> materials;
    std::string warning, error;
    bool ok = tinyobj::LoadObj(&attrib, &shapes, &materials, &warning, &error, &stream, nullptr, false, false);
    if (who->cancelled) return refuse_cancelled(why);
    if (!ok || !error.empty()) {
        why->line = line_of(error);
        why->what = error.substr(0, error.find('\n'));
        if (why->what.empty()) why->what = "not a readable OBJ";
        return false;
    }
    if (warning.find("out of bounds") != std::string::npos) {
        why->what = "a face names a vertex, normal or texture coordinate that the file doesn't have";
        return false;
    }
    return convert(attrib, shapes, who, why, out);
}

bool read(brume_context *context, const char *path, refusal *why, brume_mesh *out) {
    size_t size = 0;
    char *text = brume_text_read_file(path, &size);
    if (!text) {
        why->code = brume_read_error(errno);
        why->what = strerror(errno);
        return false;
    }
    std::string kept;
    try {
        kept.assign(text, size);
    } catch (...) {
        free(text);
        throw;
    }
    free(text);
    if (size == 0) {
        why->what = "the file is empty";
        return false;
    }
    if (kept.find('\0') != std::string::npos) {
        why->what = "the file is not text";
        return false;
    }
    end_lines(kept);
    if (!check_numbers(kept.c_str(), size, why)) return false;
    hide_weights(kept);

    listener who = {context, path, false};
    pieces buffer(kept, &who);
    std::istream stream(&buffer);
    return parse(stream, &who, why, out);
}

}  // namespace

extern "C" brume_result brume_mesh_read_obj(brume_context *context, const char *path, const brume_mesh_options *options,
                                            const char *where, brume_mesh *out) {
    if (!path || !options || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_mesh_read_obj: NULL argument");
    brume_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    brume_result result = BRUME_OK;
    try {
        refusal why;
        brume_load_begin(context);
        if (!read(context, path, &why, &mesh)) {
            std::string place = path;
            if (why.line) place += ":" + std::to_string(why.line);
            result = brume_mesh_fail(context, why.code, where, place.c_str(), why.what.c_str());
        }
    } catch (const std::bad_alloc &) {
        result = brume_mesh_fail(context, BRUME_ERROR_MEMORY, where, path, "out of memory");
    } catch (...) {
        result = brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path, "not a readable OBJ");
    }
    if (result == BRUME_OK) result = brume_mesh_finish(context, options, where, path, &mesh);
    if (result != BRUME_OK) {
        brume_mesh_free(&mesh);
        return result;
    }
    *out = mesh;
    return BRUME_OK;
}

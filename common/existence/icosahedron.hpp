// The icosahedron around a map point (thesis 003, Implementation: "Icosahedron Observability
// Shell").
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace understory::existence {

inline constexpr int kFaces = 20;
inline constexpr int kVertices = 12;
inline constexpr double kGolden = 1.6180339887498948482;

/// A face: its vertices, counter-clockwise from outside, its neighbours (`neighbours[i]` lies
/// opposite `vertices[i]`), and the rows that give a direction's weights on the vertices.
struct IcosahedronFace {
  std::array<std::uint8_t, 3> vertices{};
  std::array<std::uint8_t, 3> neighbours{};
  std::array<std::array<float, 3>, 3> weight_rows{};
};

/// Intersection of a direction with the icosahedron.
struct FacePoint {
  int face = 0;
  std::array<std::uint8_t, 3> vertices{};
  std::array<float, 3> weights{};  ///< Barycentric, of the vertices; sum 1.
};

namespace detail {

/// A vertex of the three golden rectangles. Group 0: (0, +-1, +-phi), 1: (+-phi, 0, +-1), 2: (+-1,
/// +-phi, 0); bit 0 = the first sign is minus, bit 1 = the second.
constexpr std::array<double, 3> icosahedron_vertex(int index) {
  const double first = (index & 1) != 0 ? -1.0 : 1.0;
  const double second = (index & 2) != 0 ? -1.0 : 1.0;
  switch (index / 4) {
    case 0:
      return {0.0, first, second * kGolden};
    case 1:
      return {first * kGolden, 0.0, second};
    default:
      return {first, second * kGolden, 0.0};
  }
}

/// The outward normal of a face, length sqrt(3): 0-7 (+-1, +-1, +-1) by sign bits of x, y, z; then
/// 8-11 (+-1/phi, 0, +-phi), 12-15 (+-phi, +-1/phi, 0), 16-19 (0, +-phi, +-1/phi): a dodecahedron's
/// vertices.
constexpr std::array<double, 3> icosahedron_normal(int face) {
  const double first = (face & 1) != 0 ? -1.0 : 1.0;
  const double second = (face & 2) != 0 ? -1.0 : 1.0;
  if (face < 8) return {first, second, (face & 4) != 0 ? -1.0 : 1.0};
  if (face < 12) return {first / kGolden, 0.0, second * kGolden};
  if (face < 16) return {first * kGolden, second / kGolden, 0.0};
  return {0.0, first * kGolden, second / kGolden};
}

constexpr double dot3(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
constexpr std::array<double, 3> cross3(const std::array<double, 3>& a,
                                       const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The three vertices nearest to a face's normal, counter-clockwise from outside.
constexpr std::array<std::uint8_t, 3> face_vertices(int face) {
  const auto normal = icosahedron_normal(face);
  std::array<std::uint8_t, 3> found{};
  std::size_t count = 0;
  for (int v = 0; v < kVertices && count < 3; ++v)
    if (dot3(normal, icosahedron_vertex(v)) > 2.0) found[count++] = static_cast<std::uint8_t>(v);
  const auto a = icosahedron_vertex(found[0]);
  const auto across = cross3(icosahedron_vertex(found[1]), icosahedron_vertex(found[2]));
  if (dot3(a, across) > 0.0) return found;
  return {found[0], found[2], found[1]};
}

/// Whether a face has a vertex.
constexpr bool has_vertex(const std::array<std::uint8_t, 3>& vertices, std::uint8_t vertex) {
  return vertices[0] == vertex || vertices[1] == vertex || vertices[2] == vertex;
}

constexpr IcosahedronFace make_face(int face) {
  IcosahedronFace made;
  made.vertices = face_vertices(face);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint8_t b = made.vertices[(i + 1) % 3];
    const std::uint8_t c = made.vertices[(i + 2) % 3];
    // Unscaled inverse of [a b c]: the weights are normalised afterwards.
    const auto row = cross3(icosahedron_vertex(b), icosahedron_vertex(c));
    for (std::size_t k = 0; k < 3; ++k) made.weight_rows[i][k] = static_cast<float>(row[k]);
    for (int other = 0; other < kFaces; ++other) {
      const auto vertices = face_vertices(other);
      if (other != face && has_vertex(vertices, b) && has_vertex(vertices, c))
        made.neighbours[i] = static_cast<std::uint8_t>(other);
    }
  }
  return made;
}

constexpr std::array<IcosahedronFace, kFaces> make_faces() {
  std::array<IcosahedronFace, kFaces> faces{};
  for (int face = 0; face < kFaces; ++face) faces[static_cast<std::size_t>(face)] = make_face(face);
  return faces;
}

}  // namespace detail

/// The 20 faces.
inline constexpr std::array<IcosahedronFace, kFaces> kIcosahedron = detail::make_faces();

/// Vertex v, at distance sqrt(1 + phi^2) from the centre.
inline Eigen::Vector3d icosahedron_vertex(int vertex) {
  const auto v = detail::icosahedron_vertex(vertex);
  return {v[0], v[1], v[2]};
}

/// The face that a direction (any length above 0) passes through: the signs reduce it to one octant
/// with four faces. About 12 operations and three comparisons.
inline int face_of(const Eigen::Vector3f& direction) {
  constexpr auto kPhi = static_cast<float>(kGolden);
  constexpr auto kInverse = static_cast<float>(1.0 / kGolden);
  const float x = std::abs(direction.x());
  const float y = std::abs(direction.y());
  const float z = std::abs(direction.z());
  const int sx = direction.x() < 0.0F ? 1 : 0;
  const int sy = direction.y() < 0.0F ? 1 : 0;
  const int sz = direction.z() < 0.0F ? 1 : 0;

  float most = x + y + z;
  int face = sx + 2 * sy + 4 * sz;
  const auto offer = [&](float product, int candidate) {
    face = product > most ? candidate : face;
    most = std::max(product, most);
  };
  offer(kInverse * x + kPhi * z, 8 + sx + 2 * sz);
  offer(kPhi * x + kInverse * y, 12 + sx + 2 * sy);
  offer(kPhi * y + kInverse * z, 16 + sy + 2 * sz);
  return face;
}

/// The face and the weights of its vertices: at the intersection of the direction with the face.
inline FacePoint locate_on_icosahedron(const Eigen::Vector3f& direction) {
  FacePoint point;
  point.face = face_of(direction);
  const IcosahedronFace& face = kIcosahedron[static_cast<std::size_t>(point.face)];
  point.vertices = face.vertices;
  float sum = 0.0F;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = face.weight_rows[i];
    point.weights[i] =
        std::max(0.0F, row[0] * direction.x() + row[1] * direction.y() + row[2] * direction.z());
    sum += point.weights[i];
  }
  for (float& weight : point.weights) weight /= sum;
  return point;
}

}  // namespace understory::existence

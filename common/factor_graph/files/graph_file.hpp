// Graphs as text: g2o, TORO, iSAM.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/factor_graph/graph/factor.hpp"

namespace understory::factor_graph::graph {
class FactorGraph;
}

namespace understory::factor_graph::files {

/// A graph with the numbers that its file gives. Variables of factors are positions in `vertices`.
struct GraphFile {
  /// A variable with the number that its file gives.
  struct Vertex {
    std::int64_t number = 0;
    graph::VariableType type = graph::VariableType::kPose2;
    graph::Value value{};
    bool has_value = false;  ///< Formats of measurements alone give none.
  };
  std::vector<Vertex> vertices;        ///< In order of their numbers; iSAM's landmarks last.
  std::vector<graph::Factor> factors;  ///< In order of the file.
  std::vector<std::int64_t> fixed;     ///< Numbers of vertices that the file holds fast.
  /// Lines of edges from a vertex to itself: left out, for they hold no information about it.
  std::vector<int> self_edges;
  std::vector<int> factor_lines;  ///< Line of each factor, from 1; empty where there is no file.
  /// Lines that were passed over, by their tag.
  struct Skipped {
    std::string tag;  ///< As it stands in the file, 40 bytes at most: for messages.
    int first_line = 0;
    int lines = 0;
  };
  std::vector<Skipped> skipped;  ///< The first 20 tags; the last one stands for all others.
};

/// What is wrong with a file, and in which line.
struct GraphFileError {
  int line = 0;      ///< From 1; 0 = none.
  std::string what;  ///< For messages.
};

/// Text formats of pose graphs.
enum class GraphFormat : std::uint8_t {
  kG2o,   ///< VERTEX_SE2, VERTEX_XY, VERTEX_SE3:QUAT, VERTEX_TRACKXYZ and the edges between them;
          ///< information by rows; FIX.
  kToro,  ///< VERTEX2, EDGE2; information in the order 11 12 22 33 13 23.
  kIsam,  ///< ODOMETRY or EDGE2, LANDMARK; the ROOT of the information by rows.
};

/// Format by the tags that the text contains.
GraphFormat guess_format(std::string_view text);
/// Reads a graph; lines with unknown tags are passed over and counted. Refused with the line: a
/// number that is missing or beyond 1e30, a tag that was cut, a vertex given twice or (where the
/// file gives vertices) not at all, information that is not positive semi-definite, a quaternion of
/// zero, a sensor's offset that is not the identity, a file with neither vertex nor edge. A
/// rotation's information in g2o files is of the vector part of the quaternion; the factors have it
/// of the rotation vector.
std::variant<GraphFile, GraphFileError> read_graph(std::string_view text, GraphFormat format);

/// The first vertex that the measurements do not tie to the first pose, and why: for solvers that
/// hold one pose fast and place the others by motions. None where all are tied. Fixed vertices do
/// not count. Cost: the edges.
std::optional<GraphFileError> find_untied(const GraphFile& file);

}  // namespace understory::factor_graph::files

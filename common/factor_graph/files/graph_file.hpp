// Graphs as text files: g2o, TORO, iSAM.
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

/// A graph with the numbers of its file. Variables of factors are positions in `vertices`.
struct GraphFile {
  /// A variable with its number in the file.
  struct Vertex {
    std::int64_t number = 0;
    graph::VariableType type = graph::VariableType::kPose2;
    graph::Value value{};
    bool has_value = false;  ///< False for formats that have only measurements.
  };
  std::vector<Vertex> vertices;        ///< Ordered by number; iSAM's landmarks last.
  std::vector<graph::Factor> factors;  ///< In order of the file.
  std::vector<std::int64_t> fixed;     ///< Numbers of vertices fixed by the file.
  /// Lines of edges from a vertex to itself: left out, because they have no information on it.
  std::vector<int> self_edges;
  std::vector<int> factor_lines;  ///< Line of each factor, from 1; empty where there is no file.
  /// Skipped lines, by their tag.
  struct Skipped {
    std::string tag;  ///< As in the file, at most 40 bytes: for messages.
    int first_line = 0;
    int lines = 0;
  };
  std::vector<Skipped> skipped;  ///< The first 20 tags; the last one counts all others.
};

/// The fault of a file, and its line.
struct GraphFileError {
  int line = 0;      ///< From 1; 0 = none.
  std::string what;  ///< Text for messages.
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
/// Reads a graph; lines with unknown tags are skipped and counted. Refused with the line: a missing
/// number or one beyond 1e30, a cut tag, a vertex defined twice or (where the file has vertices)
/// not at all, information that is not positive semi-definite, a quaternion of zero, a sensor's
/// offset that is not the identity, a file with neither vertex nor edge. In g2o files, information
/// on a rotation refers to the vector part of the quaternion; in the factors to the rotation
/// vector.
std::variant<GraphFile, GraphFileError> read_graph(std::string_view text, GraphFormat format);

/// The first vertex that measurements do not connect to the first pose, with the reason: for
/// solvers that fix one pose and place the others by motions. None where all are connected. Fixed
/// vertices are not considered. Cost: the edges.
std::optional<GraphFileError> find_untied(const GraphFile& file);

/// g2o text of a graph at its estimates: relative poses and Cartesian observations of points, and
/// all variables; `skipped` counts the factors that the format has no tag for. Losses are not
/// written.
std::string write_g2o(const graph::FactorGraph& graph, int* skipped = nullptr);

}  // namespace understory::factor_graph::files

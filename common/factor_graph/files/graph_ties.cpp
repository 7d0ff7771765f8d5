// Finds vertices that measurements do not connect to the first pose.
#include <algorithm>
#include <numeric>
#include <string>

#include "common/factor_graph/files/graph_file.hpp"

namespace understory::factor_graph::files {
namespace {

/// Sets of connected vertices.
class Parts {
 public:
  explicit Parts(std::size_t vertices) : parent_(vertices) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

std::size_t end_of(const graph::Factor& factor, std::size_t i) {
  return static_cast<std::size_t>(index(factor.variables[i]));
}

bool is_a_pose(const GraphFile::Vertex& vertex) {
  return vertex.type == graph::VariableType::kPose2 || vertex.type == graph::VariableType::kPose3;
}

/// Line of the first edge of a vertex; 0 = none.
int line_of(const GraphFile& file, std::size_t v) {
  for (std::size_t f = 0; f < file.factor_lines.size(); ++f) {
    if (end_of(file.factors[f], 0) == v || end_of(file.factors[f], 1) == v) {
      return file.factor_lines[f];
    }
  }
  return 0;
}

}  // namespace

std::optional<GraphFileError> find_untied(const GraphFile& file) {
  Parts by_motions(file.vertices.size());
  Parts by_anything(file.vertices.size());
  for (const graph::Factor& factor : file.factors) {
    const std::size_t a = end_of(factor, 0);
    const std::size_t b = end_of(factor, 1);
    by_anything.join(a, b);
    if (is_a_pose(file.vertices[a]) && is_a_pose(file.vertices[b])) by_motions.join(a, b);
  }

  const auto first = static_cast<std::size_t>(
      std::find_if(file.vertices.begin(), file.vertices.end(), is_a_pose) - file.vertices.begin());
  if (first == file.vertices.size()) return GraphFileError{0, "no pose in it"};
  if (file.factors.empty()) return GraphFileError{0, "no edge in it"};

  for (std::size_t v = 0; v < file.vertices.size(); ++v) {
    const std::string name = "vertex " + std::to_string(file.vertices[v].number);
    if (by_anything.find(v) != by_anything.find(first)) {
      return GraphFileError{line_of(file, v), name + ": no edges lead from it to the first pose, " +
                                                  std::to_string(file.vertices[first].number)};
    }
    if (is_a_pose(file.vertices[v]) && by_motions.find(v) != by_motions.find(first)) {
      return GraphFileError{line_of(file, v), name + ": only points tie it to the other poses"};
    }
  }
  return std::nullopt;
}

}  // namespace understory::factor_graph::files

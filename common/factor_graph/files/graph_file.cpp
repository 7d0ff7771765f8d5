#include "common/factor_graph/files/graph_file.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <span>

#include "common/factor_graph/files/graph_line.hpp"

namespace understory::factor_graph::files {
namespace {

/// Fraction of the greatest entry that rounding may leave of a zero eigenvalue; the factor graph
/// has the same limit.
constexpr double kRounding = 1e-9;
constexpr std::size_t kMostTags = 20;
constexpr std::size_t kTagBytes = 40;

template <int size>
Eigen::Matrix<double, size, size> upper_triangle(GraphLine& line) {
  Eigen::Matrix<double, size, size> m;
  for (int r = 0; r < size; ++r) {
    for (int c = r; c < size; ++c) m(r, c) = m(c, r) = line.number();
  }
  return m;
}

/// A quaternion of zero length is returned unchanged; the caller refuses it.
graph::Pose3 pose3(GraphLine& line) {
  graph::Pose3 pose;
  for (int i = 0; i < 3; ++i) pose.translation[i] = line.number();
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q[i] = line.number();
  if (!(q.norm() > 1e-3)) q.setZero();
  pose.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  return pose;
}

geometry::SE2 pose2(GraphLine& line) {
  const double x = line.number();
  const double y = line.number();
  return {x, y, line.number()};
}

bool is_semi_definite(const Eigen::MatrixXd& information) {
  if (information.llt().info() == Eigen::Success) return true;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= -kRounding * information.cwiseAbs().maxCoeff();
}

/// Every tag of a format.
std::span<const std::string_view> tags_of(GraphFormat format) {
  static constexpr std::array<std::string_view, 9> kG2oTags{
      "VERTEX_SE2", "VERTEX_XY",   "VERTEX_SE3:QUAT", "VERTEX_TRACKXYZ",  "FIX",
      "EDGE_SE2",   "EDGE_SE2_XY", "EDGE_SE3:QUAT",   "EDGE_SE3_TRACKXYZ"};
  static constexpr std::array<std::string_view, 2> kToroTags{"VERTEX2", "EDGE2"};
  static constexpr std::array<std::string_view, 3> kIsamTags{"ODOMETRY", "EDGE2", "LANDMARK"};
  if (format == GraphFormat::kG2o) return kG2oTags;
  if (format == GraphFormat::kToro) return kToroTags;
  return kIsamTags;
}

/// A prefix of a tag is a damaged tag, and its line would be lost.
bool is_cut_tag(std::string_view word, GraphFormat format) {
  const auto tags = tags_of(format);
  return std::any_of(tags.begin(), tags.end(), [&](std::string_view tag) {
    return word.size() < tag.size() && (tag.starts_with(word) || tag.ends_with(word));
  });
}

/// Information of the quaternion's vector part converted to the rotation vector, which is twice the
/// vector part.
Eigen::Matrix<double, 6, 6> of_rotation_vector(Eigen::Matrix<double, 6, 6> information) {
  information.bottomRows<3>() *= 0.5;
  information.rightCols<3>() *= 0.5;
  return information;
}

class Reader {
 public:
  explicit Reader(GraphFormat format) : format_(format) {}

  std::optional<std::string> read(std::string_view text, int line_number) {
    GraphLine line(text);
    const std::string_view word = line.word();
    if (word.empty() || word.front() == '#') return std::nullopt;
    line_ = line_number;
    const std::size_t factors = result_.factors.size();
    const bool known = read_vertex(word, line) || read_offset(word, line) || read_edge(word, line);
    if (!known) return skip(word);
    if (const auto fault = line.fault()) return *fault;
    if (error_) return error_;
    if (result_.factors.size() == factors) return std::nullopt;

    result_.factor_lines.push_back(line_number);
    if (ties_to_itself()) {
      result_.factors.pop_back();
      result_.factor_lines.pop_back();
      result_.self_edges.push_back(line_number);
      return std::nullopt;
    }
    return fault_of_edge();
  }

  /// Faults that need the whole file; line 0 = no particular line.
  std::optional<GraphFileError> fault_of_whole() const {
    if (vertices_.empty()) return GraphFileError{0, "no graph: neither a vertex nor an edge in it"};
    const bool has_values = std::any_of(vertices_.begin(), vertices_.end(),
                                        [](const auto& one) { return one.second.has_value; });
    for (const auto& [number, line] : fixed_lines_) {
      const auto vertex = vertices_.find({false, number});
      if (vertex == vertices_.end()) {
        return GraphFileError{line, "vertex " + std::to_string(number) + " is not in the file"};
      }
    }

    for (std::size_t name = 0; has_values && name < keys_.size(); ++name) {
      if (vertices_.at(keys_[name]).has_value) continue;
      return GraphFileError{
          key_lines_[name],
          "edge to vertex " + std::to_string(keys_[name].second) + ", which is not in the file"};
    }
    return std::nullopt;
  }

  GraphFile finish() {
    std::map<Key, std::size_t> places;
    for (auto& [key, vertex] : vertices_) {
      places[key] = result_.vertices.size();
      result_.vertices.push_back(vertex);
    }
    for (graph::Factor& factor : result_.factors) {
      for (int i = 0; i < factor.variable_count; ++i) {
        graph::VariableId& name = factor.variables[static_cast<std::size_t>(i)];
        name = graph::VariableId(
            static_cast<int>(places.at(keys_[static_cast<std::size_t>(index(name))])));
      }
    }
    return std::move(result_);
  }

 private:
  using Key = std::pair<bool, std::int64_t>;

  /// Counts a line of another tag.
  std::optional<std::string> skip(std::string_view word) {
    if (is_cut_tag(word, format_)) return std::string(word) + " is only a part of a tag";
    const std::string tag(word.substr(0, kTagBytes));
    auto& all = result_.skipped;
    auto found = std::find_if(all.begin(), all.end(),
                              [&](const GraphFile::Skipped& one) { return one.tag == tag; });
    if (found == all.end() && all.size() == kMostTags) found = std::prev(all.end());
    if (found == all.end()) found = all.insert(all.end(), {tag, line_, 0});
    ++found->lines;
    return std::nullopt;
  }

  /// Fault of the last edge.
  std::optional<std::string> fault_of_edge() const {
    const graph::Factor& edge = result_.factors.back();
    if (is_semi_definite(edge.information)) return std::nullopt;
    const auto number = [&](std::size_t i) {
      return std::to_string(keys_[static_cast<std::size_t>(index(edge.variables[i]))].second);
    };
    return "edge " + number(0) + " - " + number(1) +
           ": the information is not positive semi-definite";
  }

  /// Whether the last edge connects a vertex to itself.
  bool ties_to_itself() const {
    if (result_.factors.empty() || result_.factors.back().variable_count < 2) return false;
    const auto key_of = [&](int i) {
      const graph::VariableId id = result_.factors.back().variables[static_cast<std::size_t>(i)];
      return keys_[static_cast<std::size_t>(index(id))];
    };
    return key_of(0) == key_of(1);
  }

  bool read_vertex(std::string_view word, GraphLine& line) {
    using enum graph::VariableType;
    const bool g2o = format_ == GraphFormat::kG2o;
    if ((g2o && word == "VERTEX_SE2") || (format_ == GraphFormat::kToro && word == "VERTEX2")) {
      const std::int64_t number = line.integer();
      place(number, kPose2, graph::value_of(pose2(line)));
    } else if (g2o && word == "VERTEX_XY") {
      const std::int64_t number = line.integer();
      const double x = line.number();
      place(number, kPoint2, graph::value_of(Eigen::Vector2d(x, line.number())));
    } else if (g2o && word == "VERTEX_SE3:QUAT") {
      const std::int64_t number = line.integer();
      place(number, kPose3, graph::value_of(pose3_of(line)));
    } else if (g2o && word == "VERTEX_TRACKXYZ") {
      const std::int64_t number = line.integer();
      Eigen::Vector3d p;
      for (int i = 0; i < 3; ++i) p[i] = line.number();
      place(number, kPoint3, graph::value_of(p));
    } else if (g2o && word == "FIX") {
      result_.fixed.push_back(line.integer());
      fixed_lines_.emplace_back(result_.fixed.back(), line_);
    } else {
      return false;
    }
    return true;
  }

  /// Reads a sensor's offset on the pose; only the identity is accepted.
  bool read_offset(std::string_view word, GraphLine& line) {
    if (format_ != GraphFormat::kG2o) return false;
    if (word != "PARAMS_SE3OFFSET" && word != "PARAMS_SE2OFFSET") return false;
    line.integer();
    bool is_identity = true;
    if (word == "PARAMS_SE2OFFSET") {
      is_identity = pose2(line).coordinates().norm() == 0.0;
    } else {
      const graph::Pose3 offset = pose3_of(line);
      is_identity = offset.translation.norm() == 0.0 && offset.rotation.vec().norm() < 1e-12;
    }
    if (!is_identity) error_ = "an offset of a sensor that is not the identity is not supported";
    return true;
  }

  graph::Pose3 pose3_of(GraphLine& line) {
    graph::Pose3 pose = pose3(line);
    if (pose.rotation.norm() == 0.0) error_ = "the quaternion is zero";
    return pose;
  }

  bool read_edge(std::string_view word, GraphLine& line) {
    if (format_ == GraphFormat::kG2o) return read_g2o_edge(word, line);
    if (format_ == GraphFormat::kToro) {
      if (word != "EDGE2") return false;
      between(line, [](GraphLine& from) {
        Eigen::Matrix3d m;
        m(0, 0) = from.number();
        m(0, 1) = from.number();
        m(1, 1) = from.number();
        m(2, 2) = from.number();
        m(0, 2) = from.number();
        m(1, 2) = from.number();
        return Eigen::Matrix3d(m.selfadjointView<Eigen::Upper>());
      });
      return true;
    }
    if (word == "ODOMETRY" || word == "EDGE2") {
      between(line, [](GraphLine& from) {
        Eigen::Matrix3d root = upper_triangle<3>(from).triangularView<Eigen::Upper>();
        return Eigen::Matrix3d(root.transpose() * root);
      });
    } else if (word == "LANDMARK") {
      add_observation(line, [](GraphLine& from) {
        Eigen::Matrix2d root = upper_triangle<2>(from).triangularView<Eigen::Upper>();
        return Eigen::Matrix2d(root.transpose() * root);
      });
    } else {
      return false;
    }
    return true;
  }

  bool read_g2o_edge(std::string_view word, GraphLine& line) {
    using enum graph::VariableType;
    if (word == "EDGE_SE2") {
      between(line, [](GraphLine& from) { return upper_triangle<3>(from); });
    } else if (word == "EDGE_SE2_XY") {
      add_observation(line, [](GraphLine& from) { return upper_triangle<2>(from); });
    } else if (word == "EDGE_SE3:QUAT") {
      const graph::VariableId a = name(line.integer(), kPose3);
      const graph::VariableId b = name(line.integer(), kPose3);
      const graph::Pose3 measured = pose3_of(line);
      result_.factors.push_back(
          relative(a, b, measured, of_rotation_vector(upper_triangle<6>(line))));
    } else if (word == "EDGE_SE3_TRACKXYZ") {
      const graph::VariableId a = name(line.integer(), kPose3);
      const graph::VariableId b = name(line.integer(), kPoint3);
      line.integer();  // Number of the sensor's offset (PARAMS lines), which must be the identity.
      Eigen::Vector3d p;
      for (int i = 0; i < 3; ++i) p[i] = line.number();
      result_.factors.push_back(observation(a, b, p, upper_triangle<3>(line)));
    } else {
      return false;
    }
    return true;
  }

  template <typename Information>
  void between(GraphLine& line, Information&& information) {
    const graph::VariableId a = name(line.integer(), graph::VariableType::kPose2);
    const graph::VariableId b = name(line.integer(), graph::VariableType::kPose2);
    const geometry::SE2 measured = pose2(line);
    result_.factors.push_back(relative(a, b, measured, information(line)));
  }

  template <typename Information>
  void add_observation(GraphLine& line, Information&& information) {
    const graph::VariableId a = name(line.integer(), graph::VariableType::kPose2);
    const graph::VariableId b = name(line.integer(), graph::VariableType::kPoint2);
    const double x = line.number();
    const Eigen::Vector2d position(x, line.number());
    result_.factors.push_back(observation(a, b, position, information(line)));
  }

  void place(std::int64_t number, graph::VariableType type, const graph::Value& value) {
    const auto [vertex, is_new] = vertices_.try_emplace(key(number, type));
    if (!is_new && (vertex->second.has_value || vertex->second.type != type)) {
      error_ = "vertex " + std::to_string(number) + " is there twice";
    }
    vertex->second = {number, type, value, true};
  }

  /// Poses and landmarks of iSAM's files have separate numbers.
  Key key(std::int64_t number, graph::VariableType type) const {
    return {format_ == GraphFormat::kIsam && type == graph::VariableType::kPoint2, number};
  }

  /// Until all variables are known, a variable is named by its index in `keys_`.
  graph::VariableId name(std::int64_t number, graph::VariableType type) {
    const auto [vertex, is_new] = vertices_.try_emplace(key(number, type));
    if (is_new) vertex->second = {number, type, graph::value_of(geometry::SE2()), false};
    if (vertex->second.type != type) {
      error_ = "vertex " + std::to_string(number) + " is of another type elsewhere";
    }
    keys_.push_back(key(number, type));
    key_lines_.push_back(line_);
    return graph::VariableId(static_cast<int>(keys_.size() - 1));
  }

  GraphFormat format_;
  std::map<Key, GraphFile::Vertex> vertices_;
  std::vector<Key> keys_;
  std::vector<int> key_lines_;  // lines of the edges that name them
  std::vector<std::pair<std::int64_t, int>> fixed_lines_;
  int line_ = 0;
  GraphFile result_;
  std::optional<std::string> error_;
};

}  // namespace

GraphFormat guess_format(std::string_view text) {
  const auto has = [&](std::string_view word) { return text.find(word) != std::string_view::npos; };
  if (has("EDGE_SE") || has("VERTEX_")) return GraphFormat::kG2o;
  return has("VERTEX2") ? GraphFormat::kToro : GraphFormat::kIsam;
}

std::variant<GraphFile, GraphFileError> read_graph(std::string_view text, GraphFormat format) {
  Reader reader(format);
  for (int number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    if (auto error = reader.read(text.substr(0, end), number))
      return GraphFileError{number, *error};
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  if (auto error = reader.fault_of_whole()) return *error;
  return reader.finish();
}

}  // namespace understory::factor_graph::files

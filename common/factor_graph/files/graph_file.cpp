#include "common/factor_graph/files/graph_file.hpp"

#include <charconv>
#include <cmath>
#include <map>
#include <optional>

namespace understory::factor_graph::files {
namespace {

/// One line, word by word.
class Line {
 public:
  explicit Line(std::string_view text) : text_(text) {}
  std::string_view word() {
    const auto begin = text_.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return text_ = {};
    text_.remove_prefix(begin);
    const auto end = text_.find_first_of(" \t\r");
    const std::string_view result = text_.substr(0, end);
    text_.remove_prefix(result.size());
    return result;
  }
  /// The next number; a missing or malformed one is remembered.
  double number() {
    const std::string_view one = word();
    double value = 0.0;
    const auto [end, error] = std::from_chars(one.data(), one.data() + one.size(), value);
    if (error != std::errc{} || end != one.data() + one.size() || one.empty() ||
        !std::isfinite(value)) {
      is_whole_ = false;
    }
    return value;
  }
  std::int64_t integer() {
    const double value = number();
    if (std::abs(value) > 9e15 || value != std::floor(value)) is_whole_ = false;
    return is_whole_ ? static_cast<std::int64_t>(value) : 0;
  }
  bool is_whole() const { return is_whole_; }

 private:
  std::string_view text_;
  bool is_whole_ = true;
};

template <int size>
Eigen::Matrix<double, size, size> upper_triangle(Line& line) {
  Eigen::Matrix<double, size, size> m;
  for (int r = 0; r < size; ++r) {
    for (int c = r; c < size; ++c) m(r, c) = m(c, r) = line.number();
  }
  return m;
}

graph::Pose3 pose3(Line& line) {
  graph::Pose3 pose;
  for (int i = 0; i < 3; ++i) pose.translation[i] = line.number();
  Eigen::Vector4d q;
  for (int i = 0; i < 4; ++i) q[i] = line.number();
  pose.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  return pose;
}

geometry::SE2 pose2(Line& line) {
  const double x = line.number();
  const double y = line.number();
  return {x, y, line.number()};
}

/// Information of the quaternion's vector part as one of the rotation vector, which is twice it.
Eigen::Matrix<double, 6, 6> of_rotation_vector(Eigen::Matrix<double, 6, 6> information) {
  information.bottomRows<3>() *= 0.5;
  information.rightCols<3>() *= 0.5;
  return information;
}

class Reader {
 public:
  explicit Reader(GraphFormat format) : format_(format) {}

  std::optional<std::string> read(std::string_view text, int line_number) {
    Line line(text);
    const std::string_view word = line.word();
    if (word.empty() || word.front() == '#') return std::nullopt;
    const bool known = read_vertex(word, line) || read_edge(word, line);
    if (known && !line.is_whole()) return "a number is missing or is none";
    if (ties_to_itself()) {
      result_.factors.pop_back();
      result_.self_edges.push_back(line_number);
    }
    return std::move(error_);
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

  /// Of the last edge.
  bool ties_to_itself() const {
    if (result_.factors.empty() || result_.factors.back().variable_count < 2) return false;
    const auto key_of = [&](int i) {
      const graph::VariableId id = result_.factors.back().variables[static_cast<std::size_t>(i)];
      return keys_[static_cast<std::size_t>(index(id))];
    };
    return key_of(0) == key_of(1);
  }

  bool read_vertex(std::string_view word, Line& line) {
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
      place(number, kPose3, graph::value_of(pose3(line)));
    } else if (g2o && word == "VERTEX_TRACKXYZ") {
      const std::int64_t number = line.integer();
      Eigen::Vector3d p;
      for (int i = 0; i < 3; ++i) p[i] = line.number();
      place(number, kPoint3, graph::value_of(p));
    } else if (g2o && word == "FIX") {
      result_.fixed.push_back(line.integer());
    } else {
      return false;
    }
    return true;
  }

  bool read_edge(std::string_view word, Line& line) {
    if (format_ == GraphFormat::kG2o) return read_g2o_edge(word, line);
    if (format_ == GraphFormat::kToro) {
      if (word != "EDGE2") return false;
      between(line, [](Line& from) {
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
      between(line, [](Line& from) {
        Eigen::Matrix3d root = upper_triangle<3>(from).triangularView<Eigen::Upper>();
        return Eigen::Matrix3d(root.transpose() * root);
      });
    } else if (word == "LANDMARK") {
      add_observation(line, [](Line& from) {
        Eigen::Matrix2d root = upper_triangle<2>(from).triangularView<Eigen::Upper>();
        return Eigen::Matrix2d(root.transpose() * root);
      });
    } else {
      return false;
    }
    return true;
  }

  bool read_g2o_edge(std::string_view word, Line& line) {
    using enum graph::VariableType;
    if (word == "EDGE_SE2") {
      between(line, [](Line& from) { return upper_triangle<3>(from); });
    } else if (word == "EDGE_SE2_XY") {
      add_observation(line, [](Line& from) { return upper_triangle<2>(from); });
    } else if (word == "EDGE_SE3:QUAT") {
      const graph::VariableId a = name(line.integer(), kPose3);
      const graph::VariableId b = name(line.integer(), kPose3);
      const graph::Pose3 measured = pose3(line);
      result_.factors.push_back(
          relative(a, b, measured, of_rotation_vector(upper_triangle<6>(line))));
    } else if (word == "EDGE_SE3_TRACKXYZ") {
      const graph::VariableId a = name(line.integer(), kPose3);
      const graph::VariableId b = name(line.integer(), kPoint3);
      line.integer();  // The sensor's offset: this format's PARAMS lines, identity in our files.
      Eigen::Vector3d p;
      for (int i = 0; i < 3; ++i) p[i] = line.number();
      result_.factors.push_back(observation(a, b, p, upper_triangle<3>(line)));
    } else {
      return false;
    }
    return true;
  }

  template <typename Information>
  void between(Line& line, Information&& information) {
    const graph::VariableId a = name(line.integer(), graph::VariableType::kPose2);
    const graph::VariableId b = name(line.integer(), graph::VariableType::kPose2);
    const geometry::SE2 measured = pose2(line);
    result_.factors.push_back(relative(a, b, measured, information(line)));
  }

  template <typename Information>
  void add_observation(Line& line, Information&& information) {
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

  /// Poses and landmarks of iSAM's files count for themselves.
  Key key(std::int64_t number, graph::VariableType type) const {
    return {format_ == GraphFormat::kIsam && type == graph::VariableType::kPoint2, number};
  }

  /// Until all are known a variable goes by its place in `keys_`.
  graph::VariableId name(std::int64_t number, graph::VariableType type) {
    const auto [vertex, is_new] = vertices_.try_emplace(key(number, type));
    if (is_new) vertex->second = {number, type, graph::value_of(geometry::SE2()), false};
    if (vertex->second.type != type) {
      error_ = "vertex " + std::to_string(number) + " is of another type elsewhere";
    }
    keys_.push_back(key(number, type));
    return graph::VariableId(static_cast<int>(keys_.size() - 1));
  }

  GraphFormat format_;
  std::map<Key, GraphFile::Vertex> vertices_;
  std::vector<Key> keys_;
  GraphFile result_;
  std::optional<std::string> error_;
};

}  // namespace

GraphFormat guess_format(std::string_view text) {
  const auto has = [&](std::string_view word) { return text.find(word) != std::string_view::npos; };
  if (has("EDGE_SE")) return GraphFormat::kG2o;
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
  return reader.finish();
}

}  // namespace understory::factor_graph::files

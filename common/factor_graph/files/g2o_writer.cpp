#include "common/factor_graph/files/g2o_writer.hpp"

#include <charconv>
#include <utility>

namespace understory::factor_graph::files {
namespace {

/// A tag and the numbers that follow it. Without a tag: g2o has none.
struct Form {
  std::string_view tag;
  std::size_t numbers = 0;
};

Form form_of(graph::VariableType type) {
  switch (type) {
    case graph::VariableType::kPose2:
      return {"VERTEX_SE2", 3};
    case graph::VariableType::kPoint2:
      return {"VERTEX_XY", 2};
    case graph::VariableType::kPose3:
      return {"VERTEX_SE3:QUAT", 7};
    case graph::VariableType::kPoint3:
      return {"VERTEX_TRACKXYZ", 3};
    case graph::VariableType::kScalar:
      return {};
  }
  return {};
}

Form form_of(graph::FactorKind kind) {
  switch (kind) {
    case graph::FactorKind::kRelativePose2:
      return {"EDGE_SE2", 3};
    case graph::FactorKind::kPoint2:
      return {"EDGE_SE2_XY", 2};
    case graph::FactorKind::kRelativePose3:
      return {"EDGE_SE3:QUAT", 7};
    case graph::FactorKind::kPoint3:
      return {"EDGE_SE3_TRACKXYZ", 3};
    default:
      return {};
  }
}

}  // namespace

std::string G2oWriter::take() { return std::exchange(out_, {}); }

void G2oWriter::number(double value) {
  char digits[32];
  const auto end = digits_ ? std::to_chars(digits, digits + sizeof(digits), value,
                                           std::chars_format::general, *digits_)
                           : std::to_chars(digits, digits + sizeof(digits), value);
  out_ += ' ';
  out_.append(digits, end.ptr);
}

bool G2oWriter::vertex(graph::VariableType type, std::uint64_t number,
                       std::span<const double> value) {
  const Form form = form_of(type);
  if (form.tag.empty()) return false;
  out_ += form.tag;
  integer(number);
  for (const double one : value.first(form.numbers)) this->number(one);
  out_ += '\n';
  return true;
}

void G2oWriter::fix(std::uint64_t number) {
  out_ += "FIX";
  integer(number);
  out_ += '\n';
}

bool G2oWriter::edge(graph::FactorKind kind, std::span<const std::uint64_t> vertices,
                     std::span<const double> measurement, Eigen::MatrixXd information) {
  const Form form = form_of(kind);
  if (form.tag.empty()) return false;
  out_ += form.tag;
  for (const std::uint64_t vertex : vertices) integer(vertex);
  if (kind == graph::FactorKind::kPoint3) integer(0);  // The sensor.
  for (const double one : measurement.first(form.numbers)) number(one);

  if (kind == graph::FactorKind::kRelativePose3) {
    // Of the quaternion's vector part, half the rotation vector.
    information.bottomRows(3) *= 2.0;
    information.rightCols(3) *= 2.0;
  }
  for (Eigen::Index r = 0; r < information.rows(); ++r) {
    for (Eigen::Index c = r; c < information.cols(); ++c) number(information(r, c));
  }
  out_ += '\n';
  return true;
}

}  // namespace understory::factor_graph::files

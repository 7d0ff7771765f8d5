#include "eval/experiments/frontend/forest_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "common/io/text_file.hpp"

namespace understory::eval::experiments::frontend {
namespace {

using std::numbers::pi;
constexpr double kCore = 0.7;     // of a stem's radius: a beam that passes so near meets it
constexpr double kBark_m = 0.25;  // the surface of a stem is so near its circle
constexpr double kOnStem_m = 0.1;
constexpr int kShown = 6;  // points in a sector of a stem that is shown
constexpr double kKnee_m = 0.5;
constexpr double kPerson_m = 2.2;
constexpr double kNothing = std::numeric_limits<double>::infinity();

std::vector<PlotPoint> read_points(const std::filesystem::path& file) {
  static_assert(std::endian::native == std::endian::little);
  const std::string bytes = io::read_whole_file(file);
  constexpr std::size_t kRecord = 4 * sizeof(float);
  if (bytes.size() % kRecord != 0) throw std::runtime_error(file.string() + ": cut short");

  std::vector<PlotPoint> points;
  points.reserve(bytes.size() / kRecord);
  for (std::size_t i = 0; i < bytes.size(); i += kRecord) {
    std::array<float, 4> record{};
    std::memcpy(record.data(), bytes.data() + i, kRecord);
    const auto [x, y, z, height] = record;
    if (!std::isfinite(x + y + z + height)) continue;
    points.push_back({{x, y, z}, height});
  }

  if (points.empty()) throw std::runtime_error(file.string() + ": no points");
  return points;
}

std::vector<PlotStem> read_stems(const std::filesystem::path& file) {
  std::istringstream lines(io::read_whole_file(file));
  std::string line;
  std::getline(lines, line);
  if (!line.starts_with("x_m,y_m,dbh_m")) {
    throw std::runtime_error(file.string() + ": columns x_m,y_m,dbh_m expected");
  }

  std::vector<PlotStem> stems;
  while (std::getline(lines, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    PlotStem stem;
    double diameter_m = 0.0;
    if (!(numbers >> stem.position_m.x() >> stem.position_m.y() >> diameter_m)) {
      throw std::runtime_error(fmt::format("{}: not a stem: {}", file.string(), line));
    }
    stem.radius_m = 0.5 * diameter_m;
    stems.push_back(stem);
  }
  return stems;
}

double turned(double angle_rad) { return std::remainder(angle_rad, 2.0 * pi); }

}  // namespace

ForestPlot read_forest_plot(const std::filesystem::path& folder, const std::string& name) {
  return {name, read_points(folder / (name + "_slice_0.2-3.0m_xyzh_f32.bin")),
          read_stems(folder / (name + "_stems_own_estimate.csv"))};
}

PlotGround::PlotGround(std::span<const PlotPoint> points, double cell_m) : cell_m_(cell_m) {
  if (points.empty()) throw std::invalid_argument("no points to tell the ground");
  low_m_ = points.front().position_m.head<2>();

  Eigen::Vector2d high = low_m_;
  for (const PlotPoint& point : points) {
    low_m_ = low_m_.cwiseMin(point.position_m.head<2>());
    high = high.cwiseMax(point.position_m.head<2>());
  }

  columns_ = static_cast<int>((high - low_m_).x() / cell_m_) + 1;
  rows_ = static_cast<int>((high - low_m_).y() / cell_m_) + 1;
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  heights_m_.assign(cells, 0.0);

  // Mean height of the ground below the points of each cell.
  std::vector<int> counts(cells, 0);
  for (const PlotPoint& point : points) {
    const Eigen::Vector2d cell = (point.position_m.head<2>() - low_m_) / cell_m_;
    double& mean = at(static_cast<int>(cell.x()), static_cast<int>(cell.y()));
    int& count = counts[static_cast<std::size_t>(&mean - heights_m_.data())];
    mean += (point.position_m.z() - point.height_m - mean) / ++count;
  }
  fill_gaps(counts);
}

double& PlotGround::at(int column, int row) {
  return heights_m_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)];
}

double PlotGround::clamped(int column, int row) const {
  const auto c = static_cast<std::size_t>(std::clamp(column, 0, columns_ - 1));
  const auto r = static_cast<std::size_t>(std::clamp(row, 0, rows_ - 1));
  return heights_m_[r * static_cast<std::size_t>(columns_) + c];
}

/// Cells without points become the mean of those near by, weighted by distance.
void PlotGround::fill_gaps(const std::vector<int>& counts) {
  const std::vector<double> known = heights_m_;
  const auto columns = static_cast<std::size_t>(columns_);

  for (std::size_t gap = 0; gap < counts.size(); ++gap) {
    if (counts[gap] > 0) continue;
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] == 0) continue;
      const double dx = static_cast<double>(i % columns) - static_cast<double>(gap % columns);
      const std::size_t row = i / columns;
      const std::size_t gap_row = gap / columns;
      const double dy = static_cast<double>(row) - static_cast<double>(gap_row);
      const double weight = std::pow(dx * dx + dy * dy, -2.0);
      sum += weight * known[i];
      weights += weight;
    }

    heights_m_[gap] = sum / weights;
  }
}

double PlotGround::height_m(const Eigen::Vector2d& place_m) const {
  const Eigen::Vector2d cell = (place_m - low_m_) / cell_m_ - Eigen::Vector2d::Constant(0.5);
  const int column = static_cast<int>(std::floor(cell.x()));
  const int row = static_cast<int>(std::floor(cell.y()));
  const double right = cell.x() - column;
  const double up = cell.y() - row;
  return (1.0 - up) * ((1.0 - right) * clamped(column, row) + right * clamped(column + 1, row)) +
         up * ((1.0 - right) * clamped(column, row + 1) + right * clamped(column + 1, row + 1));
}

PlotScanner::PlotScanner(const ForestPlot& plot, Parameters parameters)
    : plot_(plot), parameters_(std::move(parameters)), ground_(plot.points) {
  measure_reach();
  look_around_stems();
}

void PlotScanner::look_around_stems() {
  around_.assign(plot_.stems.size(), {});
  for (const PlotPoint& point : plot_.points) {
    if (point.height_m < kKnee_m || point.height_m > kPerson_m) continue;
    for (std::size_t i = 0; i < plot_.stems.size(); ++i) {
      const Eigen::Vector2d from_axis = point.position_m.head<2>() - plot_.stems[i].position_m;
      if (std::abs(from_axis.norm() - plot_.stems[i].radius_m) > kOnStem_m) continue;
      const double turns = std::atan2(from_axis.y(), from_axis.x()) / (2.0 * pi) + 0.5;
      ++around_[i][static_cast<std::size_t>(turns * kSectors) % kSectors];
    }
  }
}

/// All sectors that are visible from there, but those at the very edges.
bool PlotScanner::is_whole(std::size_t stem, const Eigen::Vector2d& station_m) const {
  const Eigen::Vector2d to_station = station_m - plot_.stems[stem].position_m;
  const double turns = std::atan2(to_station.y(), to_station.x()) / (2.0 * pi) + 0.5;
  const int facing = static_cast<int>(turns * kSectors);
  constexpr int kSide = kSectors / 4 - 1;
  for (int i = facing - kSide; i <= facing + kSide; ++i) {
    const auto sector = static_cast<std::size_t>((i + kSectors) % kSectors);
    if (around_[stem][sector] < kShown) return false;
  }
  return true;
}

/// A little more than the distance to the fourth neighbour.
void PlotScanner::measure_reach() {
  constexpr double kMore = 1.2;
  constexpr std::size_t kNeighbours = 4;
  const double most = parameters_.most_reach_m;

  std::vector<std::size_t> by_x(plot_.points.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  const auto place = [&](std::size_t i) -> const Eigen::Vector3d& {
    return plot_.points[by_x[i]].position_m;
  };
  std::sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) {
    return plot_.points[a].position_m.x() < plot_.points[b].position_m.x();
  });

  // Distance to the fourth neighbour, along a sorted axis.
  reach_m_.assign(by_x.size(), most);
  std::vector<double> distances;
  std::size_t first = 0;
  for (std::size_t i = 0; i < by_x.size(); ++i) {
    while (place(i).x() - place(first).x() > most) ++first;
    distances.clear();
    for (std::size_t j = first; j < by_x.size() && place(j).x() - place(i).x() <= most; ++j) {
      if (j != i) distances.push_back((place(j) - place(i)).norm());
    }

    if (distances.size() < kNeighbours) continue;
    std::nth_element(distances.begin(), distances.begin() + kNeighbours - 1, distances.end());
    reach_m_[by_x[i]] =
        std::clamp(kMore * distances[kNeighbours - 1], parameters_.least_reach_m, most);
  }
}

PlotScanner::Meeting PlotScanner::meeting(const Eigen::Vector2d& station_m,
                                          double azimuth_rad) const {
  const Eigen::Vector2d ahead(std::cos(azimuth_rad), std::sin(azimuth_rad));
  Meeting result;
  for (std::size_t i = 0; i < plot_.stems.size(); ++i) {
    const PlotStem& stem = plot_.stems[i];
    const Eigen::Vector2d offset = stem.position_m - station_m;
    const double along = ahead.dot(offset);
    const double miss = std::abs(ahead.x() * offset.y() - ahead.y() * offset.x());
    if (along < stem.radius_m || miss > kCore * stem.radius_m) continue;
    const double level_m = along - std::sqrt(stem.radius_m * stem.radius_m - miss * miss);
    if (level_m < result.level_m) result = {level_m, i};
  }
  return result;
}

double PlotScanner::azimuth_of(int column) const {
  return pi - 2.0 * pi * (column + 0.5) / parameters_.columns;  // clockwise, from behind
}

std::vector<PlotScanner::Return> PlotScanner::returns_at(const Eigen::Vector3d& sensor_m) const {
  std::vector<Return> returns;
  returns.reserve(plot_.points.size());
  for (std::size_t i = 0; i < plot_.points.size(); ++i) {
    const PlotPoint& point = plot_.points[i];
    const Eigen::Vector3d ray = point.position_m - sensor_m;
    const double range = ray.norm();
    if (range < parameters_.min_range_m || range > parameters_.max_range_m) continue;
    returns.push_back(
        {std::atan2(ray.y(), ray.x()), std::asin(ray.z() / range), range, reach_m_[i]});
  }
  return returns;
}

/// The nearest surface that the beam meets. It ends at its outermost points; a point all alone is
/// as wide as a beam.
double PlotScanner::surface(std::span<const Return* const> near_beam, double azimuth_rad) const {
  const double own_rad = pi / parameters_.columns;
  for (const Return* const nearest : near_beam) {  // by range
    const Return* left = nullptr;
    const Return* right = nullptr;
    double left_rad = kNothing;
    double right_rad = kNothing;
    int points = 0;
    for (const Return* const other : near_beam) {
      if (std::abs(other->range_m - nearest->range_m) > parameters_.depth_m) continue;
      ++points;
      const double side = turned(other->azimuth_rad - azimuth_rad);
      if (side >= 0.0 && side < left_rad) {
        left_rad = side;
        left = other;
      }
      if (side < 0.0 && -side < right_rad) {
        right_rad = -side;
        right = other;
      }
    }
    if (left != nullptr && right != nullptr) {
      return (right_rad * left->range_m + left_rad * right->range_m) / (left_rad + right_rad);
    }
    if (points == 1 && std::min(left_rad, right_rad) <= own_rad) return nearest->range_m;
  }
  return kNothing;
}

std::vector<double> PlotScanner::ring(std::span<const Return> returns, double elevation_rad) const {
  const auto columns = static_cast<std::size_t>(parameters_.columns);

  // Which points are near the beam, by column.
  std::vector<std::vector<const Return*>> near_beam(columns);
  for (const Return& point : returns) {
    if (std::abs(point.elevation_rad - elevation_rad) * point.range_m > point.reach_m) {
      continue;
    }
    const double reach_rad = point.reach_m / point.range_m;
    const double per_column = 2.0 * pi / parameters_.columns;
    const double middle = (pi - point.azimuth_rad) / per_column - 0.5;
    const auto first = static_cast<int>(std::ceil(middle - reach_rad / per_column));
    const auto last = static_cast<int>(std::floor(middle + reach_rad / per_column));
    for (int column = first; column <= last; ++column) {
      const int wrapped = (column + parameters_.columns) % parameters_.columns;
      near_beam[static_cast<std::size_t>(wrapped)].push_back(&point);
    }
  }

  std::vector<double> ranges(columns, kNothing);
  for (std::size_t column = 0; column < columns; ++column) {
    std::stable_sort(near_beam[column].begin(), near_beam[column].end(),
                     [](const Return* a, const Return* b) { return a->range_m < b->range_m; });
    ranges[column] = surface(near_beam[column], azimuth_of(static_cast<int>(column)));
  }
  return ranges;
}

double PlotScanner::ground_range(const Eigen::Vector3d& sensor_m, double azimuth_rad,
                                 double elevation_rad) const {
  if (elevation_rad >= 0.0) return kNothing;
  const Eigen::Vector3d ray(std::cos(elevation_rad) * std::cos(azimuth_rad),
                            std::cos(elevation_rad) * std::sin(azimuth_rad),
                            std::sin(elevation_rad));
  const auto above = [&](double range) {
    const Eigen::Vector3d place = sensor_m + range * ray;
    return place.z() - ground_.height_m(place.head<2>());
  };
  double before = parameters_.min_range_m;
  for (double range = before; range < parameters_.max_range_m; range += 0.5) {
    if (above(range) > 0.0) {
      before = range;
      continue;
    }
    double after = range;
    for (int i = 0; i < 12; ++i) {
      const double middle = 0.5 * (before + after);
      (above(middle) > 0.0 ? before : after) = middle;
    }
    return after;
  }
  return kNothing;
}

PlotSweep PlotScanner::sweep(const Eigen::Vector2d& station_m, std::mt19937_64& random) const {
  const Eigen::Vector3d sensor(station_m.x(), station_m.y(),
                               ground_.height_m(station_m) + parameters_.sensor_height_m);
  const std::vector<Return> returns = returns_at(sensor);

  std::vector<std::vector<double>> ranges;
  for (const double elevation : parameters_.elevations_rad) {
    ranges.push_back(ring(returns, elevation));
  }

  PlotSweep result;
  result.stems.resize(plot_.stems.size());
  for (std::size_t i = 0; i < result.stems.size(); ++i) {
    result.stems[i].is_whole = is_whole(i, station_m);
  }

  model::PointSweep& sweep = result.sweep;
  sweep.is_deskewed = true;
  sweep.rings = static_cast<std::uint16_t>(ranges.size());
  sweep.max_range_m = parameters_.max_range_m;
  sweep.sensor_position_m = {0.0, 0.0, parameters_.sensor_height_m};
  sweep.attitude =
      model::Attitude{Eigen::Quaterniond::Identity(), 1e-6 * Eigen::Matrix2d::Identity()};

  constexpr double kTurn_s = 0.1;
  std::normal_distribution<double> noise(0.0, parameters_.range_sigma_m);
  for (int column = 0; column < parameters_.columns; ++column) {
    const double azimuth = azimuth_of(column);
    const Meeting stem = meeting(station_m, azimuth);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const double elevation = parameters_.elevations_rad[i];
      const double exact = std::min(ranges[i][static_cast<std::size_t>(column)],
                                    ground_range(sensor, azimuth, elevation));

      const double surplus = exact * std::cos(elevation) - stem.level_m;  // NaN: nothing at all
      const double above =
          sensor.z() + stem.level_m * std::tan(elevation) - ground_.height_m(station_m);
      if (above > kKnee_m && above < kPerson_m && !(surplus < -kBark_m)) {
        ++result.stems[stem.stem].beams;
        if (surplus <= kBark_m) ++result.stems[stem.stem].returns;
      }
      if (!std::isfinite(exact) || surplus > kBark_m) continue;

      const double range = exact + noise(random);
      model::SweepPoint point;
      point.x_m = static_cast<float>(range * std::cos(elevation) * std::cos(azimuth));
      point.y_m = static_cast<float>(range * std::cos(elevation) * std::sin(azimuth));
      point.z_m = static_cast<float>(range * std::sin(elevation) + parameters_.sensor_height_m);
      point.time_s = static_cast<float>(kTurn_s * ((column + 1.0) / parameters_.columns - 1.0));
      point.ring = static_cast<std::uint16_t>(i);
      sweep.points.push_back(point);
    }
  }
  return result;
}

}  // namespace understory::eval::experiments::frontend

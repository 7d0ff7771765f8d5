#include "common/bag/cloud_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/bag/cloud_fields.hpp"
#include "common/io/data_error.hpp"
#include "common/io/ring_finder.hpp"

namespace understory::bag {
namespace {

constexpr std::array<std::string_view, 12> kTimeNames{"t",
                                                      "time",
                                                      "timestamp",
                                                      "time_stamp",
                                                      "offset_time",
                                                      "time_offset",
                                                      "time_offset_ns",
                                                      "timeStamp",
                                                      "timestamp_ns",
                                                      "time_ns",
                                                      "point_time",
                                                      "ts"};
constexpr std::array<std::string_view, 8> kRingNames{"ring",    "line",      "channel", "laser_id",
                                                     "ring_id", "scan_line", "laser",   "beam"};
constexpr std::array<std::string_view, 4> kIntensityNames{"reflectivity", "intensity", "i",
                                                          "intensities"};

constexpr double kShortestRevolution_s = 0.002;
/// A cloud may be a single packet.
constexpr double kShortestPacket_s = 0.0005;
constexpr double kLongestRevolution_s = 1.5;
constexpr double kLongestSweep_s = 5.0;
/// A clock with a larger difference from the stamp's is another clock.
constexpr double kSameClock_s = 10.0;
/// Times relative to the stamp are shorter; absolute times are longer.
constexpr double kRelative_s = 5.0;
constexpr std::uint32_t kMostRings = 256;
/// Noise may place a reading at full range beyond it by this factor.
constexpr double kNoise = 1.01;
/// Times with steps coarser than this share of the sweep are ignored.
constexpr double kFinestShare = 0.01;

/// Unit [s] of times with this `spread`: nanoseconds for integers, seconds for floats, unless only
/// another unit gives a possible duration of a sweep.
double time_unit(double spread, FieldType type) {
  const bool is_float = type == FieldType::kFloat32 || type == FieldType::kFloat64;
  const double usual = is_float ? 1.0 : 1e-9;
  if (spread * usual >= kShortestPacket_s && spread * usual <= kLongestRevolution_s) return usual;
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9}) {
    if (spread * unit >= kShortestRevolution_s && spread * unit <= kLongestRevolution_s)
      return unit;
  }
  if (spread * usual <= kLongestSweep_s) return usual;
  throw io::DataError(
      fmt::format("the points' times lie {:g} apart: no unit makes a sweep of that", spread));
}

}  // namespace

/// Raw field values of a point.
struct CloudDecoder::RawPoint {
  Eigen::Vector3f position_m;
  double time = 0.0;  ///< Time in the field's unit.
  /// The same for an integer field: nanoseconds since 1970 do not fit into a double.
  std::int64_t ticks = 0;
  std::uint32_t ring = 0;
  double intensity = 0.0;
};

/// Source of a point's ring.
enum class CloudDecoder::RingPlace : std::uint8_t { kNone, kField, kRow, kColumn };

/// The fields by meaning.
struct CloudDecoder::Layout {
  FieldReader x, y, z;
  std::optional<FieldReader> time, ring, intensity;
  CloudRows rows;
  RingPlace ring_place = RingPlace::kNone;

  std::uint32_t ring_at(const std::uint8_t* point, std::uint32_t row, std::uint32_t column) const {
    if (ring_place == RingPlace::kRow) return row;
    if (ring_place == RingPlace::kColumn) return column;
    if (ring_place == RingPlace::kNone) return 0;
    const double number = ring->value(point);
    if (!(number >= 0.0 && number < kMostRings))
      throw io::DataError(fmt::format("ring {} of {} at most", number, kMostRings - 1));
    return static_cast<std::uint32_t>(number);
  }
};

CloudDecoder::Layout CloudDecoder::layout_of(const PointCloud& cloud) const {
  const auto one = [&](std::string_view name) {
    const auto field = find_field(cloud, std::array{name});
    if (!field) throw io::DataError(fmt::format("a cloud without the field {}", name));
    return *field;
  };
  Layout layout{one("x"), one("y"), one("z"), {}, {}, {}, rows_of(cloud), RingPlace::kNone};
  layout.time = find_field(cloud, kTimeNames);
  layout.ring = find_field(cloud, kRingNames);
  layout.intensity = find_field(cloud, kIntensityNames);
  // One dimension of an organised cloud is the sensor's beams, which are fewer than its firings.
  // Ouster has one beam per row, RoboSense one per column.
  const std::uint32_t fewer = std::min(cloud.height, cloud.width);
  if (layout.ring) {
    layout.ring_place = RingPlace::kField;
  } else if (fewer > 1 && fewer <= kMostRings) {
    layout.ring_place = fewer == cloud.height ? RingPlace::kRow : RingPlace::kColumn;
  }
  return layout;
}

model::PointSweep CloudDecoder::decode(const PointCloud& cloud) {
  const Layout layout = layout_of(cloud);
  std::vector<RawPoint> points;
  points.reserve(layout.rows.points());

  for (std::uint32_t row = 0; row < layout.rows.rows; ++row) {
    for (std::uint32_t column = 0; column < layout.rows.columns; ++column) {
      const std::uint8_t* at = layout.rows.at(cloud.data, row, column);
      RawPoint point;
      point.position_m = {static_cast<float>(layout.x.value(at)),
                          static_cast<float>(layout.y.value(at)),
                          static_cast<float>(layout.z.value(at))};
      if (!point.position_m.allFinite() || point.position_m.isZero(0.0F)) continue;
      if (layout.time && layout.time->is_integer()) {
        point.ticks = layout.time->integer(at);
        point.time = static_cast<double>(point.ticks);
      } else if (layout.time) {
        point.time = layout.time->value(at);
        if (!std::isfinite(point.time)) continue;
      }
      point.ring = layout.ring_at(at, row, column);
      if (layout.intensity) point.intensity = layout.intensity->value(at);
      points.push_back(point);
    }
  }

  const bool has_found = layout.ring_place == RingPlace::kNone && take_found_rings(points);
  if (layout.ring_place == RingPlace::kRow) rings_ = std::max(rings_, layout.rows.rows);
  if (layout.ring_place == RingPlace::kColumn) rings_ = std::max(rings_, layout.rows.columns);
  if (layout.time) {
    decide_time(points, cloud.header.stamp_ns, layout.time->type());
    time_text_ = time_text(*layout.time);
  }
  if (layout.intensity) decide_intensity(points, layout.intensity->is_integer());
  if (layout.ring_place == RingPlace::kField) ring_text_ = layout.ring->name();
  if (layout.ring_place == RingPlace::kRow) ring_text_ = "rows";
  if (layout.ring_place == RingPlace::kColumn) ring_text_ = "columns";
  return sweep_of(std::move(points), cloud.header, layout.time.has_value(),
                  has_found || layout.ring_place != RingPlace::kNone);
}

/// Searches rings in a cloud without a ring field; false where none were found.
bool CloudDecoder::take_found_rings(std::vector<RawPoint>& points) {
  std::vector<Eigen::Vector3f> positions_m;
  positions_m.reserve(points.size());
  for (const RawPoint& point : points) positions_m.push_back(point.position_m);
  const io::FoundRings found = io::find_rings(positions_m);
  if (found.ring.empty()) return false;

  for (std::size_t i = 0; i < points.size(); ++i) points[i].ring = found.ring[i];
  rings_ = std::max<std::uint32_t>(rings_, found.rings);
  ring_order_ = RingOrder::kUpwards;
  ring_text_ = fmt::format("not in the cloud, found from {}", found.from);
  return true;
}

std::string CloudDecoder::time_text(const FieldReader& field) const {
  if (!unit_s_)
    return fmt::format("none ({} is {})", field.name(),
                       is_too_coarse_ ? "a float32 too coarse for its values" : "always the same");
  const std::string_view from = is_own_clock_
                                    ? "of a clock of its own: the first point is at the stamp"
                                : is_absolute_ ? "of the stamp's clock"
                                               : "from the stamp";
  return fmt::format("{} ({}, unit {:g} s, {})", field.name(), field.type_name(), *unit_s_, from);
}

model::PointSweep CloudDecoder::decode(const LivoxCloud& cloud) {
  std::vector<RawPoint> points;
  points.reserve(cloud.points.size());
  for (const LivoxCloud::Point& from : cloud.points) {
    if (!from.position_m.allFinite() || from.position_m.isZero(0.0F)) continue;
    points.push_back({from.position_m, static_cast<double>(from.offset_ns),
                      static_cast<std::int64_t>(from.offset_ns), from.line,
                      static_cast<double>(from.reflectivity)});
  }
  unit_s_ = 1e-9;
  intensity_factor_ = 1.0;
  time_text_ = "offset_time (uint32, unit 1e-09 s, from the stamp)";
  ring_text_ = "line";
  return sweep_of(std::move(points), cloud.header, true, true);
}

/// Decided by the first cloud whose points have different times.
void CloudDecoder::decide_time(const std::vector<RawPoint>& points, std::int64_t stamp_ns,
                               FieldType type) {
  if (unit_s_ || points.empty()) return;
  const auto [first, last] = std::ranges::minmax(points, {}, &RawPoint::time);
  const double spread = last.time - first.time;
  if (spread <= 0.0) return;
  // Seconds since 1970 do not fit into a float: its steps are then two minutes.
  constexpr double kRelativeStep = 1.2e-7;
  const double step = kRelativeStep * std::max(std::abs(first.time), std::abs(last.time));
  is_too_coarse_ = type == FieldType::kFloat32 && step > kFinestShare * spread;
  if (is_too_coarse_) return;

  unit_s_ = options_.time_unit_s ? *options_.time_unit_s : time_unit(spread, type);
  const double middle_s = 0.5 * (first.time + last.time) * *unit_s_;
  const double from_stamp_s = middle_s - 1e-9 * static_cast<double>(stamp_ns);
  // On a clock that starts near 0, only doubles have enough digits for absolute times near the
  // stamp.
  is_absolute_ = std::abs(middle_s) > kRelative_s ||
                 (type == FieldType::kFloat64 && std::abs(from_stamp_s) < std::abs(middle_s));
  is_own_clock_ = is_absolute_ && std::abs(from_stamp_s) > kSameClock_s;
}

void CloudDecoder::decide_intensity(const std::vector<RawPoint>& points, bool is_integer) {
  if (intensity_factor_ || points.empty()) return;
  const auto brightest = std::ranges::max(points, {}, &RawPoint::intensity).intensity;
  if (!is_integer && brightest <= 0.0) return;
  // Floats up to 1 are fractions.
  intensity_factor_ = !is_integer && brightest <= 1.0 ? 255.0 : 1.0;
}

/// Decided by the first cloud with two rings, from the elevation of each ring.
void CloudDecoder::decide_rings(const std::vector<RawPoint>& points) {
  if (ring_order_ != RingOrder::kUnknown) return;
  std::array<double, kMostRings> sum{};
  std::array<std::uint32_t, kMostRings> count{};
  for (const RawPoint& point : points) {
    const double elevation = std::atan2(point.position_m.z(), point.position_m.head<2>().norm());
    sum[point.ring] += elevation;
    ++count[point.ring];
  }

  std::vector<std::pair<double, std::uint32_t>> seen;
  for (std::uint32_t ring = 0; ring < kMostRings; ++ring) {
    if (count[ring] > 0) seen.emplace_back(sum[ring] / count[ring], ring);
  }
  if (seen.size() < 2) return;
  rings_ = std::max(rings_, seen.back().second + 1);

  std::size_t upwards = 0;
  for (std::size_t i = 1; i < seen.size(); ++i)
    upwards += seen[i].first > seen[i - 1].first ? 1 : 0;
  if (upwards == seen.size() - 1) {
    ring_order_ = RingOrder::kUpwards;
  } else if (upwards == 0) {
    ring_order_ = RingOrder::kDownwards;
    constexpr std::array<std::uint32_t, 7> kUsual{4, 8, 16, 32, 64, 128, 256};
    rings_ = *std::ranges::lower_bound(kUsual, rings_);
  } else {
    ring_order_ = RingOrder::kTable;
    std::ranges::sort(seen);
    ring_table_.assign(kMostRings, 0);
    std::uint16_t next = 0;
    for (const auto& [elevation, ring] : seen) ring_table_[ring] = next++;
    for (std::uint32_t ring = 0; ring < kMostRings; ++ring) {
      if (count[ring] == 0) ring_table_[ring] = std::min<std::uint16_t>(next++, kMostRings - 1);
    }
  }
}

std::uint16_t CloudDecoder::ring_of(std::uint32_t ring) const {
  if (ring_order_ == RingOrder::kTable) return ring_table_[ring];
  if (ring_order_ == RingOrder::kDownwards)
    return static_cast<std::uint16_t>(ring < rings_ ? rings_ - 1 - ring : 0);
  return static_cast<std::uint16_t>(ring);
}

/// Nanoseconds from the stamp, in integers: absolute times need more digits than a double has.
std::vector<std::int64_t> CloudDecoder::times_from_stamp(const std::vector<RawPoint>& points,
                                                         std::int64_t stamp_ns) const {
  constexpr double kMost_ns = 4e18;
  const double unit_ns = 1e9 * *unit_s_;
  const std::int64_t tick_ns = std::llround(unit_ns);
  const std::int64_t base_ns = is_absolute_ && !is_own_clock_ ? stamp_ns : 0;
  std::vector<std::int64_t> times;
  times.reserve(points.size());

  for (const RawPoint& point : points) {
    const double rough_ns = point.time * unit_ns;
    if (!(std::abs(rough_ns) < kMost_ns) || std::abs(stamp_ns) > 5'000'000'000'000'000'000)
      throw io::DataError(fmt::format("{:g} is no time of a point", point.time));
    const bool is_exact = point.ticks != 0 && unit_ns >= 1.0;
    const std::int64_t time_ns =
        is_exact ? point.ticks * tick_ns : static_cast<std::int64_t>(std::llround(rough_ns));
    if (std::abs(static_cast<double>(time_ns) - static_cast<double>(base_ns)) > kMost_ns)
      throw io::DataError(fmt::format("{:g} is no time of a point", point.time));
    times.push_back(time_ns - base_ns);
  }
  return times;
}

/// Sets utime and each point's time relative to it.
void CloudDecoder::set_times(const std::vector<RawPoint>& points, const Header& header,
                             model::PointSweep& sweep) const {
  std::vector<std::int64_t> times(points.size(), 0);
  if (sweep.has_times) times = times_from_stamp(points, header.stamp_ns);
  const std::int64_t first_ns = times.empty() ? 0 : std::ranges::min(times);
  const std::int64_t last_ns = times.empty() ? 0 : std::ranges::max(times);
  const double duration_s = 1e-9 * (static_cast<double>(last_ns) - static_cast<double>(first_ns));
  if (duration_s > kLongestSweep_s)
    throw io::DataError(fmt::format("the points' times lie {:.3f} s apart", duration_s));

  // The sweep begins at the stamp if that is not later than the first point, else at the first
  // point.
  const bool is_stamp_first =
      is_own_clock_ || (first_ns >= 0 && 1e-9 * static_cast<double>(first_ns) < kRelative_s);
  const std::int64_t begin_ns = header.stamp_ns + (is_stamp_first ? 0 : first_ns);
  sweep.utime = begin_ns >= 0 ? begin_ns / 1000 : -((-begin_ns + 999) / 1000);
  const std::int64_t zero_ns =
      sweep.utime * 1000 - header.stamp_ns + (is_own_clock_ ? first_ns : 0);
  if (!sweep.has_times) return;
  for (std::size_t i = 0; i < points.size(); ++i)
    sweep.points[i].time_s = static_cast<float>(1e-9 * static_cast<double>(times[i] - zero_ns));
}

model::PointSweep CloudDecoder::sweep_of(std::vector<RawPoint> points, const Header& header,
                                         bool has_times, bool has_rings) {
  const double most_m = kNoise * options_.max_range_m;
  std::erase_if(points, [&](const RawPoint& point) {
    return point.position_m.cast<double>().squaredNorm() > most_m * most_m;
  });
  if (has_rings) decide_rings(points);
  model::PointSweep sweep;
  sweep.revolution = revolutions_++;
  // A constant field has no times.
  sweep.has_times = has_times && unit_s_.has_value();
  sweep.max_range_m = options_.max_range_m;

  sweep.points.reserve(points.size());
  const double intensity_factor = intensity_factor_.value_or(1.0);
  for (const RawPoint& from : points) {
    model::SweepPoint point;
    point.x_m = from.position_m.x();
    point.y_m = from.position_m.y();
    point.z_m = from.position_m.z();
    point.ring = ring_of(from.ring);
    const double intensity = from.intensity * intensity_factor;
    if (intensity > 0.0)
      point.intensity = static_cast<std::uint8_t>(std::min(intensity + 0.5, 255.0));
    if (has_rings) rings_ = std::max<std::uint32_t>(rings_, point.ring + 1U);
    sweep.points.push_back(point);
  }

  set_times(points, header, sweep);
  sweep.rings = static_cast<std::uint16_t>(rings_);
  const auto is_before = [](const model::SweepPoint& a, const model::SweepPoint& b) {
    return a.time_s < b.time_s || (a.time_s == b.time_s && a.ring < b.ring);
  };
  if (!std::ranges::is_sorted(sweep.points, is_before))
    std::ranges::stable_sort(sweep.points, is_before);
  return sweep;
}

std::string CloudDecoder::description() const {
  std::string rings = ring_text_;
  if (ring_text_ != "none") {
    rings += fmt::format(", {} {}", rings_,
                         ring_order_ == RingOrder::kDownwards ? "counted downwards, turned round"
                         : ring_order_ == RingOrder::kTable   ? "in an order of their own, sorted"
                                                              : "counted upwards");
  }
  return fmt::format("times: {}; rings: {}", time_text_, rings);
}

}  // namespace understory::bag

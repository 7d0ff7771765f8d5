#include "common/map_file/layer_rows.hpp"

#include "common/map_file/geometry_blob.hpp"
#include "common/map_file/reference_rows.hpp"

namespace understory::map_file {
namespace {

/// A variance or covariance; none if the matrix was not computed.
using Entry = std::optional<double>;

std::int64_t signed_of(std::uint64_t value) { return static_cast<std::int64_t>(value); }

template <class Matrix>
Entry entry(const Matrix& matrix, int row, int column) {
  if (matrix.isZero(0.0)) return std::nullopt;
  return 0.5 * (matrix(row, column) + matrix(column, row));
}

}  // namespace

LandmarkRows::LandmarkRows(const Connection& connection, SameLandmark same)
    : insert_(connection.prepare(
          std::string(same == SameLandmark::kReplaced ? "INSERT OR REPLACE" : "INSERT") +
          " INTO landmarks (landmark_id, geom, map_id, submap_id, covariance_xx_m2, "
          "covariance_xy_m2, covariance_yy_m2, diameter_m, kind, times_seen, existence) "
          "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)")),
      srs_id_(srs_of_layers(connection)) {}

void LandmarkRows::put(std::uint32_t map_id, const StoredLandmark& one) {
  const model::MapLandmark& landmark = one.landmark;
  const auto point = point_blob(landmark.position_m, srs_id_);
  const auto& covariance = landmark.covariance_m2;
  std::optional<std::int64_t> submap;
  if (one.submap_id) submap = signed_of(*one.submap_id);
  Entry diameter;
  if (landmark.radius_m > 0.0) diameter = 2.0 * landmark.radius_m;
  const bool is_trunk = landmark.kind == model::LandmarkKind::kTrunk;
  insert_
      .bind(signed_of(landmark.id), Blob(point), std::int64_t{map_id}, submap,
            entry(covariance, 0, 0), entry(covariance, 0, 1), entry(covariance, 1, 1), diameter,
            is_trunk ? kTrunkText : kCornerText, std::int64_t{landmark.observation_count},
            one.existence)
      .run();
}

KeyframeRows::KeyframeRows(const Connection& connection)
    : insert_(connection.prepare(
          "INSERT OR REPLACE INTO trajectory (fid, geom, map_id, sequence, utime, heading_rad, "
          "covariance_xx_m2, covariance_xy_m2, covariance_yy_m2, covariance_xt_m_rad, "
          "covariance_yt_m_rad, covariance_tt_rad2) "
          "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)")),
      srs_id_(srs_of_layers(connection)) {}

void KeyframeRows::put(std::int64_t number, std::uint32_t map_id, const model::KeyframePose& pose) {
  const auto point = point_blob(pose.map_T_vehicle.translation(), srs_id_);
  const auto& covariance = pose.covariance;
  insert_
      .bind(number, Blob(point), std::int64_t{map_id}, signed_of(pose.keyframe_sequence),
            std::int64_t{pose.utime}, pose.map_T_vehicle.theta(), entry(covariance, 0, 0),
            entry(covariance, 0, 1), entry(covariance, 1, 1), entry(covariance, 0, 2),
            entry(covariance, 1, 2), entry(covariance, 2, 2))
      .run();
}

BorderRows::BorderRows(const Connection& connection)
    : insert_(connection.prepare("INSERT OR REPLACE INTO submap_borders (fid, geom, map_id, "
                                 "submap_id) VALUES (?1, ?2, ?3, ?4)")),
      srs_id_(srs_of_layers(connection)) {}

void BorderRows::put(std::int64_t number, std::uint32_t map_id, const SubmapBorder& border) {
  const auto polygon = geometry_blob({GeometryKind::kPolygon, border.corners_m}, srs_id_);
  insert_.bind(number, Blob(polygon), std::int64_t{map_id}, signed_of(border.submap_id)).run();
}

LoopRows::LoopRows(const Connection& connection)
    : insert_(connection.prepare("INSERT OR REPLACE INTO loop_closures (fid, geom, map_id, "
                                 "from_sequence, to_sequence) VALUES (?1, ?2, ?3, ?4, ?5)")),
      srs_id_(srs_of_layers(connection)) {}

void LoopRows::put(std::int64_t number, std::uint32_t map_id, const LoopClosure& loop) {
  const auto line = geometry_blob({GeometryKind::kLine, {loop.from_m, loop.to_m}}, srs_id_);
  insert_
      .bind(number, Blob(line), std::int64_t{map_id}, signed_of(loop.from_sequence),
            signed_of(loop.to_sequence))
      .run();
}

}  // namespace understory::map_file

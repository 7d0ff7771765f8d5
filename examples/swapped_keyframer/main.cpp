// A user's own keyframer: each scan with enough landmarks becomes a keyframe. Run it instead of
// understory-keyframer; the channels are the only interface.
#include <memory>

#include "common/bus/service.hpp"
#include "common/model/keyframe.hpp"

namespace {

using namespace understory;  // NOLINT(google-build-using-namespace): an example

model::Keyframe keyframe_of(const model::LandmarkScan& scan, std::uint64_t sequence) {
  model::Keyframe keyframe;
  keyframe.utime = scan.utime;
  keyframe.sequence = sequence;
  keyframe.field_of_view = scan.field_of_view;
  // The only member is the base, and the landmarks' frame is the vehicle's: the pose of the base in
  // it is exact, with a sigma of 1 mm so that no covariance is singular.
  model::KeyframeMember base;
  base.utime = scan.utime;
  base.sequence = scan.sequence;
  base.covariance = 1e-6 * Eigen::Matrix3d::Identity();
  keyframe.members.push_back(base);
  for (const model::Detection& detection : scan.detections) {
    keyframe.landmarks.push_back({.position_m = detection.position_m.head<2>(),
                                  .covariance_m2 = detection.covariance_m2.topLeftCorner<2, 2>(),
                                  .radius_m = detection.radius_m,
                                  .observation_count = 1,
                                  .kind = detection.kind});
  }
  return keyframe;
}

class OneScanAdapter : public bus::Adapter {
 public:
  void describe(bus::ParameterTable& table) override {
    table.add("min_landmarks", min_landmarks_, {1, 1000}, "landmarks",
              "Scans with fewer landmarks make no keyframe.");
  }

  void bind(bus::Node& node) override {
    node.subscribe<model::LandmarkScan>("LANDMARKS",
                                        [this](const model::LandmarkScan& scan) { add(scan); });
    keyframes_ = node.advertise<model::Keyframe>("KEYFRAME");
  }

 private:
  void add(const model::LandmarkScan& scan) {
    if (std::ssize(scan.detections) < min_landmarks_) return;
    keyframes_.publish(keyframe_of(scan, sequence_++));
  }

  int min_landmarks_ = 6;
  std::uint64_t sequence_ = 0;
  bus::Publisher<model::Keyframe> keyframes_;
};

}  // namespace

int main(int argc, char** argv) {
  bus::ChannelList channels;
  channels.in("LANDMARKS", "detections of one sweep");
  channels.out("KEYFRAME", "local landmarks of one sweep");
  return bus::run_service(
      {"swapped-keyframer", channels, [] { return std::make_unique<OneScanAdapter>(); }}, argc,
      argv);
}

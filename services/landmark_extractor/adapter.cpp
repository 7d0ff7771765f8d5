#include "services/landmark_extractor/adapter.hpp"

#include <memory>
#include <optional>

#include "services/landmark_extractor/adapter_parameters.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"

namespace understory {
namespace {

class LandmarkExtractorAdapter : public Adapter {
 public:
  explicit LandmarkExtractorAdapter(LandmarkExtractorChannels channels)
      : channels_(std::move(channels)) {}

  void describe(ParameterTable& table) override { understory::describe(parameters_, table); }

  void bind(Node& node) override {
    stage_.emplace(parameters_);
    node.subscribe<PlanarScan>(
        channels_.lidar_scan,
        [this](const PlanarScan& scan) { landmarks_.publish(stage_->extract(scan)); },
        {.queue_size = 200});
    landmarks_ = node.advertise<LandmarkScan>(channels_.landmarks);
  }

 private:
  LandmarkExtractorChannels channels_;
  LandmarkExtractorParameters parameters_;
  std::optional<LandmarkExtractor> stage_;
  Publisher<LandmarkScan> landmarks_;
};

}  // namespace

Service landmark_extractor_service(const LandmarkExtractorChannels& channels) {
  return {"landmark_extractor", channels.lidar_scan + " -> " + channels.landmarks,
          [channels] { return std::make_unique<LandmarkExtractorAdapter>(channels); }};
}

}  // namespace understory

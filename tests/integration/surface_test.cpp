// reconstruct to the textured mesh, and densify, mesh and texture on a model that exists.

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/ply.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kTimeLimit{200};

/// Frames of the demo recording with small depth maps, for which its true poses are known.
class Surface : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    fs::create_directories(path("set/images"));
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(demo() / "images")) {
      frames.push_back(entry.path());
    }
    std::sort(frames.begin(), frames.end());
    for (std::size_t i = 0; i < frames.size(); i += 8) {
      fs::copy_file(frames[i], fs::path(path("set/images")) / frames[i].filename());
    }
  }

  [[nodiscard]] static fs::path demo() { return source_path("tools/demo/courtyard"); }

  [[nodiscard]] std::vector<std::string> reconstruct(const std::vector<std::string>& more) const {
    std::vector<std::string> all{"reconstruct",
                                 path("set"),
                                 "--output",
                                 path("out"),
                                 "--no-upsample",
                                 "--poses",
                                 (demo() / "gt").string(),
                                 "--depth-size",
                                 "200",
                                 "--texture-size",
                                 "1024",
                                 "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  [[nodiscard]] std::vector<std::string> stage(const std::string& name,
                                               const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{name,
                                 path("out"),
                                 "--images",
                                 path("set"),
                                 "--depth-size",
                                 "200",
                                 "--texture-size",
                                 "1024",
                                 "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

TEST_F(Surface, ReconstructEndsWithATexturedMesh) {
  const ProgramResult result = run_trigmesh(reconstruct({"--threads", "1"}), kTimeLimit);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto cloud = read_dense_ply(contents(path("out/model/dense.ply")));
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_GT(cloud->size(), 5000U);
  const auto mesh = read_mesh_ply(contents(path("out/model/mesh.ply")));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_GT(mesh->faces.size(), 5000U);
  EXPECT_EQ(contents(path("out/model/textured.glb")).substr(0, 4), "glTF");
  EXPECT_THAT(contents(path("out/model/textured.obj")), HasSubstr("mtllib textured.mtl"));
  EXPECT_FALSE(fs::exists(path("out/work")));
  EXPECT_THAT(contents(path("out/model/report.json")), HasSubstr("\"gap_ratio\""));
  EXPECT_THAT(result.out, AnyOf(HasSubstr("\nReady"), HasSubstr("\nNot ready")));

  const auto one_thread = all_files(path("out/model"));
  ASSERT_EQ(run_trigmesh(reconstruct({"--threads", "2"}), kTimeLimit).exit_code, 0);
  EXPECT_EQ(all_files(path("out/model")), one_thread) << "the number of threads changes no byte";
}

TEST_F(Surface, SingleStagesLeadToTheSameFiles) {
  std::ofstream(path("set/images/broken.jpg")) << "no picture";
  ASSERT_EQ(run_trigmesh(reconstruct({}), kTimeLimit).exit_code, 0);
  const auto at_once = all_files(path("out/model"));
  fs::remove_all(path("out"));
  ASSERT_EQ(run_trigmesh(reconstruct({"--stop-after", "sparse"}), kTimeLimit).exit_code, 0);
  for (const char* name : {"densify", "mesh", "texture"}) {
    const ProgramResult result = run_trigmesh(stage(name), kTimeLimit);
    ASSERT_EQ(result.exit_code, 0) << name << ": " << result.err;
  }
  const auto by_stages = all_files(path("out/model"));
  for (const char* name :
       {"dense.ply", "mesh.ply", "textured.glb", "textured.obj", "report.json"}) {
    EXPECT_TRUE(by_stages.at(name) == at_once.at(name)) << name;
  }
  EXPECT_THAT(by_stages.at("report.json"), HasSubstr("\"unreadable\""));
}

TEST_F(Surface, GoesOnWhereItWasInterrupted) {
  ASSERT_EQ(run_trigmesh(reconstruct({}), kTimeLimit).exit_code, 0);
  const auto uninterrupted = all_files(path("out/model"));
  fs::remove_all(path("out"));
  std::string command;
  for (const std::string& word : reconstruct({})) {
    command += fmt::format(" '{}'", word);
  }
  const ProgramResult interrupted = run_program(
      {"sh",
       "-c",
       fmt::format("'{}' {} & pid=$!; until [ -e '{}' ]; do :; done; kill -TERM $pid; wait $pid",
                   program_path(),
                   command,
                   path("out/work/photometric-000002"))},
      kTimeLimit);
  ASSERT_EQ(interrupted.exit_code, 130) << interrupted.err;
  EXPECT_TRUE(fs::exists(path("out/model/sparse.ply"))) << "the sparse model is there already";
  ASSERT_EQ(run_trigmesh(reconstruct({}), kTimeLimit).exit_code, 0);
  EXPECT_EQ(all_files(path("out/model")), uninterrupted);
}

TEST_F(Surface, PreviewNeedsNoDepthMaps) {
  const ProgramResult result = run_trigmesh(reconstruct({"--preset", "preview"}), kTimeLimit);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_FALSE(fs::exists(path("out/model/dense.ply")));
  EXPECT_TRUE(fs::exists(path("out/model/mesh.ply")));
  EXPECT_TRUE(fs::exists(path("out/model/textured.glb")));
  EXPECT_EQ(run_trigmesh(reconstruct({"--preset", "preview", "--stop-after", "dense"})).exit_code,
            2);
}

TEST_F(Surface, AModelWithoutPointsIsRefusedWithTheReason) {
  fs::create_directories(path("bare/sparse"));
  for (const char* name : {"cameras.txt", "images.txt"}) {
    fs::copy_file(demo() / "gt" / name, fs::path(path("bare/sparse")) / name);
  }
  const ProgramResult result = run_trigmesh(
      {"densify", path("bare"), "--images", demo().string(), "--output", path("out"), "--quiet"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("no depth maps can be made"));
}

TEST_F(Surface, SaysWhatIsMissing) {
  EXPECT_EQ(run_trigmesh({"mesh", path("nowhere")}).exit_code, 3);
  ASSERT_EQ(run_trigmesh(reconstruct({"--stop-after", "sparse"}), kTimeLimit).exit_code, 0);
  const ProgramResult no_photos = run_trigmesh({"mesh", path("out")});
  EXPECT_EQ(no_photos.exit_code, 3);
  EXPECT_THAT(no_photos.err, HasSubstr("--images"));
  const ProgramResult too_small =
      run_trigmesh(stage("mesh", {"--memory-limit", "20M"}), kTimeLimit);
  EXPECT_EQ(too_small.exit_code, 7);
  EXPECT_THAT(too_small.err, HasSubstr("--memory-limit"));
}

}  // namespace
}  // namespace trigmesh::test_support

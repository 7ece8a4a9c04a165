// Judges the texture of a finished reconstruction: textures its mesh without every n-th photograph
// and compares what the left out cameras see with what they took.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/pipeline/photo_images.hpp"
#include "firmware/pipeline/surface_plan.hpp"
#include "firmware/pipeline/worker_pool.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/exchange/ply.hpp"
#include "sfm/texture/image_similarity.hpp"
#include "sfm/texture/texture_surface.hpp"
#include "sfm/texture/textured_render.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr double kDifferenceGain = 4.0;  // small differences must be seen in the pictures

struct Arguments {
  std::string result;
  std::string photos;
  std::string output;
  std::size_t every = 8;
  int threads = 2;
  MaskUse masks = MaskUse::kUse;
  BuildOptions build;
};

/// Some of the pictures of another source, with or without their masks.
class ChosenImages final : public ViewImageSource {
 public:
  ChosenImages(const ViewImageSource& all, std::vector<std::size_t> chosen, MaskUse masks)
      : all_(all), chosen_(std::move(chosen)), masks_(masks) {}

  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override {
    TM_ASSIGN_OR_RETURN(ViewImage image, all_.load(chosen_[view]));
    if (masks_ == MaskUse::kIgnore) {
      image.mask.release();
    }
    return image;
  }

 private:
  const ViewImageSource& all_;
  std::vector<std::size_t> chosen_;
  MaskUse masks_;
};

/// The rendering with the exposure and white balance of the photograph: one factor a channel, by
/// least squares over the covered pixels. Exposure says nothing about a texture.
cv::Mat with_exposure_of(const cv::Mat& photograph, const RenderedView& rendered) {
  cv::Vec3d products(0.0, 0.0, 0.0);
  cv::Vec3d squares(1e-9, 1e-9, 1e-9);
  for (int y = 0; y < photograph.rows; ++y) {
    for (int x = 0; x < photograph.cols; ++x) {
      if (rendered.coverage.at<std::uint8_t>(y, x) != 0) {
        const cv::Vec3d made(rendered.rgb.at<cv::Vec3b>(y, x));
        products += made.mul(cv::Vec3d(photograph.at<cv::Vec3b>(y, x)));
        squares += made.mul(made);
      }
    }
  }
  cv::Mat result;
  cv::multiply(
      rendered.rgb,
      cv::Scalar(products[0] / squares[0], products[1] / squares[1], products[2] / squares[2]),
      result);
  return result;
}

/// How alike a rendering and a photograph are, as they are and with the exposure matched.
struct Judgement {
  ImageSimilarity as_is;
  ImageSimilarity exposed;
};

/// Squared error and similarity of several views, weighted by their covered pixels.
struct Totals {
  double squared_error = 0.0;
  double squared_error_exposed = 0.0;
  double similarity = 0.0;
  double covered = 0.0;
  double pixels = 0.0;

  void add(const Judgement& view, double pixel_count) {
    const auto count = static_cast<double>(view.as_is.pixel_count);
    squared_error += count * std::pow(10.0, -view.as_is.psnr_db / 10.0);
    squared_error_exposed += count * std::pow(10.0, -view.exposed.psnr_db / 10.0);
    similarity += count * view.exposed.ssim;
    covered += count;
    pixels += pixel_count;
  }

  void print() const {
    const double count = std::max(1.0, covered);
    const auto psnr_db = [count](double error) {
      return -10.0 * std::log10(std::max(1e-10, error / count));
    };
    fmt::print(
        "all: PSNR {:.2f} dB as is, exposure matched {:.2f} dB, SSIM {:.4f}, {:.1f} % of the "
        "pixels covered\n",
        psnr_db(squared_error),
        psnr_db(squared_error_exposed),
        similarity / count,
        100.0 * covered / std::max(1.0, pixels));
  }
};

void print_report(const TextureReport& report) {
  fmt::print(
      "{} faces ({} by splitting), {} with a picture ({:.2f} %), {} views, {} looks rejected\n",
      report.face_count,
      report.added_face_count,
      report.textured_face_count,
      100.0 * static_cast<double>(report.textured_face_count) /
          static_cast<double>(report.face_count),
      report.view_count,
      report.rejected_look_count);
  fmt::print(
      "{} charts on {} page(s) of {}, filled {:.1f} %, {:.2f} texels a pixel, texel {:.4g}\n",
      report.chart_count,
      report.page_count,
      report.page_size_px,
      100.0 * report.atlas_fill_ratio,
      report.texels_per_pixel,
      report.texel_size);
  fmt::print("step across seams {:.2f} -> {:.2f} (gains {:.2f} to {:.2f}) -> {:.2f} grey levels\n",
             report.seam_step_before,
             report.seam_step_after_gains,
             report.smallest_gain,
             report.largest_gain,
             report.seam_step_after);
}

/// Photograph, rendering and their difference (grey where nothing is covered), side by side.
cv::Mat side_by_side(const cv::Mat& photograph, const RenderedView& rendered) {
  const cv::Size size = photograph.size();
  cv::Mat picture(size.height, 3 * size.width, CV_8UC3);
  const auto part = [&](int index) {
    return picture(cv::Rect(index * size.width, 0, size.width, size.height));
  };
  photograph.copyTo(part(0));
  rendered.rgb.copyTo(part(1));
  cv::Mat difference;
  cv::absdiff(photograph, rendered.rgb, difference);
  difference *= kDifferenceGain;
  difference.setTo(cv::Scalar(128, 128, 128), rendered.coverage == 0);
  difference.copyTo(part(2));
  return picture;
}

/// What the mask of the photograph leaves out does not count.
Result<Judgement> judge_view(const TexturedMesh& textured,
                             const DenseView& view,
                             const ViewImage& image,
                             const std::string& output) {
  RenderedView rendered = render_textured(textured, view.camera, view.cam_from_world);
  const cv::Mat& photograph = image.rgb;
  if (!image.mask.empty()) {
    rendered.coverage.setTo(0, image.mask == 0);
  }
  const Judgement judgement{
      .as_is = compare_images(rendered.rgb, photograph, rendered.coverage),
      .exposed =
          compare_images(with_exposure_of(photograph, rendered), photograph, rendered.coverage)};
  fmt::print(
      "{}: PSNR {:.2f} dB as is, exposure matched {:.2f} dB, SSIM {:.4f}, {:.1f} % covered\n",
      view.name,
      judgement.as_is.psnr_db,
      judgement.exposed.psnr_db,
      judgement.exposed.ssim,
      100.0 * static_cast<double>(judgement.as_is.pixel_count) /
          static_cast<double>(photograph.total()));
  if (!output.empty()) {
    TM_ASSIGN_OR_RETURN(const auto png, encode_png(side_by_side(photograph, rendered)));
    const fs::path file = fs::path(output) / (fs::path(view.name).stem().string() + ".png");
    TM_RETURN_IF_ERROR(write_file_atomically(
        file, {reinterpret_cast<const char*>(png.data()), png.size()}, Durability::kCache));
  }
  return judgement;
}

Result<TextureResult> texture_without(const TriangleMesh& mesh,
                                      const std::vector<DenseView>& views,
                                      const ViewImageSource& images,
                                      const Arguments& arguments) {
  std::vector<std::size_t> kept;
  std::vector<DenseView> kept_views;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v % arguments.every != 0) {
      kept.push_back(v);
      kept_views.push_back(views[v]);
    }
  }
  TM_ASSIGN_OR_RETURN(const SurfacePlan plan, plan_surface(kept_views, arguments.build, 0));
  WorkerPool executor(arguments.threads);
  const ChosenImages chosen(images, std::move(kept), arguments.masks);
  return texture_surface(mesh, kept_views, chosen, plan.texture, executor);
}

Result<> run(const Arguments& arguments) {
  TM_ASSIGN_OR_RETURN(const Scene scene, read_model(arguments.result));
  TM_ASSIGN_OR_RETURN(
      const std::string ply,
      read_file(fs::path(arguments.result) / "model" / "mesh.ply", kMaxModelFileBytes));
  TM_ASSIGN_OR_RETURN(const TriangleMesh mesh, read_mesh_ply(ply));
  TM_ASSIGN_OR_RETURN(const PhotoSet photos,
                      open_photos(arguments.photos, Subfolders::kInclude, MaskUse::kUse));
  const std::vector<DenseView> views = dense_views(scene);
  TM_ASSIGN_OR_RETURN(const PhotoImages images, PhotoImages::create(photos, scene, views));
  TM_ASSIGN_OR_RETURN(const TextureResult made, texture_without(mesh, views, images, arguments));
  print_report(made.report);
  if (!arguments.output.empty()) {
    TM_RETURN_IF_ERROR(make_directory(arguments.output));
  }
  Totals totals;
  for (std::size_t v = 0; v < views.size(); v += arguments.every) {
    TM_ASSIGN_OR_RETURN(const ViewImage image, images.load(v));
    TM_ASSIGN_OR_RETURN(const Judgement judgement,
                        judge_view(made.textured, views[v], image, arguments.output));
    totals.add(judgement, static_cast<double>(image.rgb.total()));
  }
  totals.print();
  return {};
}

}  // namespace
}  // namespace trigmesh

int main(int argc, char** argv) {
  CLI::App app("Texture a mesh without every n-th photograph and compare with those");
  trigmesh::Arguments arguments;
  app.add_option("RESULT", arguments.result, "A result of trigmesh reconstruct")->required();
  app.add_option("PHOTOS", arguments.photos, "The photographs it was made of")->required();
  app.add_option("--output",
                 arguments.output,
                 "Folder for pictures: photograph, rendering, difference times four");
  app.add_option("--every", arguments.every, "Leave out views 0, n, 2n, ...")
      ->check(CLI::Range(2, 1000));
  app.add_option("--texture-size", arguments.build.texture_size_px, "Largest side of a page, px");
  app.add_option("--threads", arguments.threads)->check(CLI::Range(1, 64));
  app.add_flag_callback(
      "--no-masks",
      [&arguments] { arguments.masks = trigmesh::MaskUse::kIgnore; },
      "Texture without the masks beside the photographs; they still tell what is judged");
  CLI11_PARSE(app, argc, argv);
  const auto done = trigmesh::run(arguments);
  if (!done) {
    fmt::print(stderr, "error: {}\n", done.error().message);
    return 1;
  }
  return 0;
}

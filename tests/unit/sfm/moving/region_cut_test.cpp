#include "sfm/moving/region_cut.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace trigmesh {
namespace {

/// A red field of 30x20 pixels on grey, with one mark in it.
struct Field {
  MovingView view;
  RegionMarks marks;
  cv::Rect field{10, 8, 30, 20};
};

Field make_field() {
  Field made;
  made.view.rgb = cv::Mat(40, 60, CV_8UC3, cv::Scalar(120, 120, 120));
  made.view.rgb(made.field).setTo(cv::Scalar(200, 40, 40));
  made.marks = {cv::Mat(40, 60, CV_8UC1, cv::Scalar(0)),
                cv::Mat(40, 60, CV_8UC1, cv::Scalar(0)),
                cv::Mat(40, 60, CV_8UC1, cv::Scalar(0))};
  made.marks.moving(cv::Rect(22, 15, 5, 5)).setTo(255);
  return made;
}

ColorPreference preference_of(const Field& field) {
  ColorPreference preference;
  preference.add(field.view, field.marks.moving);
  return preference;
}

TEST(RegionCut, GrowsFromAMarkToTheEdgesOfThePicture) {
  const Field field = make_field();
  const cv::Mat region = cut_region(field.view, field.marks, preference_of(field));
  cv::Mat expected(40, 60, CV_8UC1, cv::Scalar(0));
  expected(field.field).setTo(255);
  EXPECT_EQ(cv::countNonZero(region != expected), 0);
}

TEST(RegionCut, StopsAtWhatIsFixed) {
  Field field = make_field();
  field.marks.fixed(cv::Rect(30, 0, 30, 40)).setTo(255);
  const cv::Mat region = cut_region(field.view, field.marks, preference_of(field));
  EXPECT_EQ(cv::countNonZero(region(cv::Rect(30, 0, 30, 40))), 0);
  EXPECT_EQ(cv::countNonZero(region), 20 * 20);
}

TEST(RegionCut, StaysOutOfGivenMasks) {
  Field field = make_field();
  field.view.mask = cv::Mat(40, 60, CV_8UC1, cv::Scalar(255));
  field.view.mask(cv::Rect(0, 0, 22, 40)).setTo(0);
  const cv::Mat region = cut_region(field.view, field.marks, preference_of(field));
  EXPECT_EQ(cv::countNonZero(region(cv::Rect(0, 0, 22, 40))), 0);
  EXPECT_GT(cv::countNonZero(region), 0);
}

TEST(RegionCut, KeepsOffSettledMarks) {
  Field field = make_field();
  field.marks.settled(cv::Rect(34, 8, 6, 20)).setTo(255);
  const cv::Mat region = cut_region(field.view, field.marks, preference_of(field));
  EXPECT_EQ(region.at<std::uint8_t>(18, 37), 0);
  EXPECT_NE(region.at<std::uint8_t>(18, 20), 0);
}

TEST(RegionCut, WithoutMarksIsEmpty) {
  Field field = make_field();
  field.marks.moving.setTo(0);
  EXPECT_EQ(cv::countNonZero(cut_region(field.view, field.marks, ColorPreference{})), 0);
}

TEST(ColorPreference, IsForTheColoursOfWhatMoved) {
  const Field field = make_field();
  const ColorPreference preference = preference_of(field);
  EXPECT_GT(preference({200, 40, 40}), 0.5F);
  EXPECT_LT(preference({120, 120, 120}), -0.5F);
  EXPECT_NEAR(preference({10, 250, 10}), 0.0F, 1e-4F) << "a colour that was never seen";
  EXPECT_EQ(ColorPreference{}({200, 40, 40}), 0.0F);
}

}  // namespace
}  // namespace trigmesh

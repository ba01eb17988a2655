"""lariat/perception"""

"""lariat/planning"""

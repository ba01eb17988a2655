"""lariat/control"""

"""lariat/safety"""
